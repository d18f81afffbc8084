// The loader's promises on small files made here.
#include "actors/scene/gltf_loader.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <limits>

#include "tests/unit/scene/small_glb.hpp"

namespace darm::scene::test {
namespace {

using testing::HasSubstr;

glm::vec3 world(const Scene& s, std::size_t instance, std::size_t vertex) {
  const Instance& i = s.instances.at(instance);
  return glm::vec3(i.to_world * glm::vec4(s.meshes[i.mesh].positions.at(vertex), 1.0f));
}

TEST(GltfLoader, GivesALightlessSceneSunAndSky) {
  const auto s = load({});
  ASSERT_TRUE(s) << s.error().message;
  ASSERT_EQ((*s)->lights.size(), 1u);
  EXPECT_EQ((*s)->lights[0].kind, LightKind::kDirectional);
  EXPECT_GT((*s)->lights[0].angular_diameter, 0.0f);
  EXPECT_TRUE((*s)->sky.emits());
  EXPECT_LT((*s)->lights[0].object, (*s)->objects.size());
}

// glTF's own emission ends at 1, white on a display: a dial is no lamp. What is stronger says so by its extension.
TEST(GltfLoader, GivesASceneThatOnlyGlowsSunAndSkyButNotOneWithALampSurface) {
  const auto with_material = [](const std::string& material) {
    SmallScene s;
    s.primitive += R"(,"material":0)";
    s.more_members = R"(,"materials":[)" + material + "]";
    return load(s).value();
  };
  EXPECT_TRUE(with_material(R"({"emissiveFactor":[1,1,1]})")->sky.emits());
  const auto lamp = with_material(
      R"({"emissiveFactor":[0,1,0],"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":2}}})");
  EXPECT_FALSE(lamp->sky.emits());
  EXPECT_TRUE(lamp->lights.empty());
  EXPECT_TRUE(with_material(R"({"extensions":{"KHR_materials_unlit":{}}})")->lights.empty()) << "nothing takes light";
}

TEST(GltfLoader, TakesConfiguredLightInsteadOfTheDefault) {
  LightSetup setup;
  setup.sky = Sky{glm::vec3(1), glm::vec3(1), glm::vec3(1)};
  const auto s = load({}, setup);
  ASSERT_TRUE(s);
  EXPECT_TRUE((*s)->lights.empty());
  EXPECT_NE((*s)->hash, (*load({}))->hash);
  setup.sun = Sun{glm::vec3(0), glm::vec3(1), 0.5f};
  EXPECT_THAT(load({}, setup).error().message, HasSubstr("sun: direction"));
}

TEST(GltfLoader, RefusesACycleOfNodes) {
  SmallScene s;
  s.nodes = R"([{"children":[1]},{"children":[2]},{"children":[0],"mesh":0}])";
  EXPECT_THAT(load(s).error().message, HasSubstr("cycle"));
}

TEST(GltfLoader, RefusesTooDeepAHierarchyWithoutRecursing) {
  SmallScene s;
  s.nodes = "[";
  for (int i = 0; i < 20000; ++i) s.nodes += R"({"children":[)" + std::to_string(i + 1) + "]},";
  s.nodes += R"({"mesh":0}])";
  EXPECT_THAT(load(s).error().message, HasSubstr("deeper"));
  LoadLimits limits;
  limits.max_depth = 30000;
  EXPECT_TRUE(load(s, {}, limits));
}

TEST(GltfLoader, RefusesDeeplyNestedJson) {
  SmallScene s;
  s.more_members = R"(,"extras":)" + std::string(100000, '[') + std::string(100000, ']');
  EXPECT_THAT(load(s).error().message, HasSubstr("nests deeper"));
}

TEST(GltfLoader, RefusesAnIndexPastTheVertices) {
  SmallScene s;
  append(s.more_binary, std::vector<std::uint16_t>{0, 1, 3});
  s.more_views = R"(,{"buffer":0,"byteOffset":36,"byteLength":6})";
  s.more_accessors = R"(,{"bufferView":1,"componentType":5123,"type":"SCALAR","count":3})";
  s.primitive += R"(,"indices":1)";
  EXPECT_THAT(load(s).error().message, HasSubstr("primitive 0: index 3 points past its 3 vertices"));
}

TEST(GltfLoader, RefusesCountsThatTheBytesDoNotHold) {
  SmallScene s;
  s.more_accessors = R"(,{"bufferView":0,"componentType":5126,"type":"VEC3","count":4000000000})";
  s.primitive = R"("attributes":{"POSITION":1})";
  EXPECT_THAT(load(s).error().message, HasSubstr("accessor 1: needs 4000000000 elements"));
}

TEST(GltfLoader, AppliesSparseElements) {
  SmallScene s;
  append(s.more_binary, std::vector<std::uint32_t>{2});
  append(s.more_binary, std::vector<float>{0, 5, 0});
  s.more_views = R"(,{"buffer":0,"byteOffset":36,"byteLength":4},{"buffer":0,"byteOffset":40,"byteLength":12})";
  s.more_accessors = R"(,{"bufferView":0,"componentType":5126,"type":"VEC3","count":3,"sparse":{"count":1,)"
                     R"("indices":{"bufferView":1,"componentType":5125},"values":{"bufferView":2}}})";
  s.primitive = R"("attributes":{"POSITION":1})";
  const auto loaded = load(s);
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ((*loaded)->bounds_max, glm::vec3(1, 5, 0));
}

TEST(GltfLoader, ReadsNormalizedAndPlainQuantizedPositions) {
  SmallScene s;
  append(s.more_binary, std::vector<std::int16_t>{0, 0, 0, 0, 32767, 0, 0, 0, 0, -32767, 0, 0});
  s.more_views = R"(,{"buffer":0,"byteOffset":36,"byteLength":24,"byteStride":8})";
  s.more_accessors = R"(,{"bufferView":1,"componentType":5122,"type":"VEC3","count":3,"normalized":true})";
  s.primitive = R"("attributes":{"POSITION":1})";
  s.more_members = R"(,"extensionsRequired":["KHR_mesh_quantization"])";
  auto loaded = load(s);
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ((*loaded)->bounds_max, glm::vec3(1, 0, 0));
  EXPECT_EQ((*loaded)->bounds_min, glm::vec3(0, -1, 0));
  s.more_accessors = R"(,{"bufferView":1,"componentType":5122,"type":"VEC3","count":3})";
  loaded = load(s);
  ASSERT_TRUE(loaded);
  EXPECT_EQ(glm::dvec3((*loaded)->bounds_max) + (*loaded)->origin, glm::dvec3(32767, 0, 0));
}

TEST(GltfLoader, PlacesGpuInstances) {
  SmallScene s;
  append(s.more_binary, std::vector<float>{0, 0, 0, 10, 0, 0, 0, 0, -3});
  s.more_views = R"(,{"buffer":0,"byteOffset":36,"byteLength":36})";
  s.more_accessors = R"(,{"bufferView":1,"componentType":5126,"type":"VEC3","count":3})";
  s.nodes = R"([{"mesh":0,"scale":[2,2,2],"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":1}}}}])";
  const auto loaded = load(s);
  ASSERT_TRUE(loaded) << loaded.error().message;
  ASSERT_EQ((*loaded)->instances.size(), 3u);
  EXPECT_EQ((*loaded)->meshes.size(), 1u);
  EXPECT_EQ(world(**loaded, 1, 0), glm::vec3(20, 0, 0));
  EXPECT_EQ((*loaded)->triangle_count(), 3u);
  LoadLimits limits;
  limits.max_triangles = 2;
  EXPECT_THAT(load(s, {}, limits).error().message, HasSubstr("over the limit of 2 triangles"));
}

TEST(GltfLoader, MarksMirroredInstancesAndDropsSingularOnes) {
  SmallScene s;
  s.nodes =
      R"([{"mesh":0,"scale":[-1,1,1]},{"mesh":0},{"mesh":0,"scale":[0,1,1]},{"mesh":0,"translation":[1e30,0,0]}])";
  s.roots = "[0,1,2,3]";
  const auto loaded = load(s);
  ASSERT_TRUE(loaded) << loaded.error().message;
  ASSERT_EQ((*loaded)->instances.size(), 2u);
  EXPECT_TRUE((*loaded)->instances[0].flipped);
  EXPECT_FALSE((*loaded)->instances[1].flipped);
  ASSERT_EQ((*loaded)->dropped.size(), 2u);
  EXPECT_THAT((*loaded)->dropped[1].reason, HasSubstr("singular"));
}

TEST(GltfLoader, RecentresWhatLiesFarOut) {
  SmallScene s;
  s.nodes =
      R"([{"mesh":0,"translation":[1000000.25,0,-2000000.5]},{"mesh":0,"translation":[1000004.25,0,-2000000.5]}])";
  s.roots = "[0,1]";
  const auto loaded = load(s);
  ASSERT_TRUE(loaded) << loaded.error().message;
  const Scene& scene = **loaded;
  EXPECT_NEAR(scene.origin.x, 1000002.75, 1e-6);
  EXPECT_LT(std::abs(scene.bounds_max.x), 10.0f);
  // Two triangles 4 m apart stay exactly that, and file coordinates come back in double.
  EXPECT_EQ(world(scene, 1, 0).x - world(scene, 0, 0).x, 4.0f);
  EXPECT_NEAR(scene.origin.x + static_cast<double>(world(scene, 0, 1).x), 1000001.25, 1e-5);
}

TEST(GltfLoader, KeepsVerticesFarOutInTheirMeshApart) {
  SmallScene s;
  s.positions = {1e6f, 0, 0, 1e6f + 0.5f, 0, 0, 1e6f, 0.5f, 0};
  const auto loaded = load(s);
  ASSERT_TRUE(loaded);
  EXPECT_EQ(world(**loaded, 0, 1).x - world(**loaded, 0, 0).x, 0.5f);
}

TEST(GltfLoader, DropsWhatHasNoAreaOrNoPlace) {
  const float inf = std::numeric_limits<float>::infinity();
  SmallScene s;
  s.positions = {0, 0, 0, 1, 0, 0, 0, 1, 0, /**/ 0, 0, 0, 1, 1, 1, 2, 2, 2, /**/ 0, 0, 0, inf, 0, 0, 0, 1, 0};
  const auto loaded = load(s);
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ((*loaded)->triangle_count(), 1u);
  EXPECT_EQ((*loaded)->meshes[0].positions.size(), 3u);
  ASSERT_EQ((*loaded)->dropped.size(), 2u);
  EXPECT_EQ((*loaded)->dropped[0].triangles + (*loaded)->dropped[1].triangles, 2u);
}

TEST(GltfLoader, TurnsStripsAndFansIntoLists) {
  SmallScene s;
  s.positions = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
  s.primitive = R"("attributes":{"POSITION":0},"mode":5)";
  const auto strip = load(s);
  ASSERT_TRUE(strip);
  ASSERT_EQ((*strip)->triangle_count(), 2u);
  for (const auto& n : (*strip)->meshes[0].normals) EXPECT_GT(n.z, 0.99f);  // both triangles keep the winding
  s.positions = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
  s.primitive = R"("attributes":{"POSITION":0},"mode":6)";
  const auto fan = load(s);
  ASSERT_TRUE(fan);
  ASSERT_EQ((*fan)->triangle_count(), 2u);
  for (const auto& n : (*fan)->meshes[0].normals) EXPECT_GT(n.z, 0.99f);
}

TEST(GltfLoader, ReadsMaterialsLightsAndMarks) {
  SmallScene s;
  s.nodes = R"([{"name":"lamp","mesh":0,"rotation":[0.70710678,0,0,0.70710678],"extras":{"darm_dynamic":true},)"
            R"("extensions":{"KHR_lights_punctual":{"light":0}}},{"camera":0,"translation":[1,2,3]}])";
  s.roots = "[0,1]";
  s.primitive += R"(,"material":0)";
  s.more_members =
      R"(,"cameras":[{"name":"eye","type":"perspective","perspective":{"yfov":0.9,"znear":0.1}}],)"
      R"("materials":[{"emissiveFactor":[1,0.5,0],"alphaMode":"MASK","alphaCutoff":0.25,"doubleSided":true,"extensions":{)"
      R"("KHR_materials_emissive_strength":{"emissiveStrength":8},"KHR_materials_ior":{"ior":1.33},)"
      R"("KHR_materials_transmission":{"transmissionFactor":0.75},)"
      R"("KHR_materials_volume":{"thicknessFactor":0.1,"attenuationDistance":2,"attenuationColor":[0.5,1,1]}}}],)"
      R"("extensions":{"KHR_lights_punctual":{"lights":[{"type":"spot","color":[1,0,0.5],"intensity":10,"range":4,)"
      R"("spot":{"innerConeAngle":0.1,"outerConeAngle":0.5}}]}})";
  const auto loaded = load(s);
  ASSERT_TRUE(loaded) << loaded.error().message;
  const Scene& scene = **loaded;
  const Material& m = scene.materials.at(0);
  EXPECT_EQ(m.emissive, glm::vec3(8, 4, 0));
  EXPECT_EQ(m.alpha_mode, AlphaMode::kMask);
  EXPECT_EQ(m.alpha_cutoff, 0.25f);
  EXPECT_TRUE(m.double_sided);
  EXPECT_FLOAT_EQ(m.ior, 1.33f);
  EXPECT_FLOAT_EQ(m.transmission, 0.75f);
  EXPECT_FLOAT_EQ(m.attenuation_distance, 2.0f);
  ASSERT_EQ(scene.lights.size(), 1u);
  const Light& l = scene.lights[0];
  EXPECT_EQ(l.intensity, glm::vec3(10, 0, 5));
  EXPECT_NEAR(l.direction.y, 1.0f, 1e-6f);  // -Z turned by 90 degrees about X
  EXPECT_NEAR(l.cos_outer, std::cos(0.5f), 1e-6f);
  EXPECT_TRUE(scene.objects.at(l.object).dynamic);
  EXPECT_EQ(scene.objects.at(l.object).name, "lamp");
  ASSERT_EQ(scene.cameras.size(), 1u);
  EXPECT_EQ(scene.cameras[0].name, "eye");
  EXPECT_EQ(scene.cameras[0].camera.position, glm::dvec3(1, 2, 3));
}

std::vector<std::string> warnings_of_light(const std::string& members, std::size_t lights = 1) {
  SmallScene s;
  s.nodes = R"([{"mesh":0,"extensions":{"KHR_lights_punctual":{"light":0}}}])";
  s.more_members = R"(,"extensions":{"KHR_lights_punctual":{"lights":[)";
  for (std::size_t i = 0; i < lights; ++i)
    s.more_members.append(i == 0 ? "" : ",").append(R"({"type":"point","name":"lamp",)").append(members).append("}");
  s.more_members += "]}}";
  const auto loaded = load(s);
  EXPECT_TRUE(loaded) << loaded.error().message;
  return loaded ? (*loaded)->warnings : std::vector<std::string>();
}

TEST(GltfLoader, NamesALightWhoseIntensityItChanges) {
  EXPECT_THAT(warnings_of_light(R"("intensity":1e12)"), testing::IsEmpty());
  EXPECT_THAT(warnings_of_light(R"("intensity":-5)"),
              testing::ElementsAre("light 0 'lamp' has a negative intensity; it is taken as 0, no light"));
  EXPECT_THAT(warnings_of_light(R"("color":[1,-1,0],"intensity":5)"),
              testing::ElementsAre(HasSubstr("negative intensity")));
  EXPECT_THAT(warnings_of_light(R"("intensity":1e15)"), testing::ElementsAre(HasSubstr("taken as 1e12")));
  EXPECT_THAT(warnings_of_light(R"("color":[1e200,1,1],"intensity":1e200)"),
              testing::ElementsAre(HasSubstr("not finite")));
}

TEST(GltfLoader, DoesNotNameLightsWithoutEnd) {
  const auto warnings = warnings_of_light(R"("intensity":-5)", 100);
  EXPECT_LT(warnings.size(), 20u);
  EXPECT_THAT(warnings.back(), HasSubstr("more lights"));
}

std::vector<std::string> warnings_of_strength(const std::string& strength, std::size_t materials = 1) {
  SmallScene s;
  s.primitive += R"(,"material":0)";
  s.more_members = R"(,"materials":[)";
  for (std::size_t i = 0; i < materials; ++i)
    s.more_members +=
        (i == 0 ? "" : ",") +
        (R"({"name":"lamp","emissiveFactor":[1,1,1],"extensions":{"KHR_materials_emissive_strength":)" + strength) +
        "}}";
  s.more_members += "]";
  const auto loaded = load(s);
  EXPECT_TRUE(loaded) << loaded.error().message;
  return loaded ? (*loaded)->warnings : std::vector<std::string>();
}

TEST(GltfLoader, NamesAMaterialWhoseEmissionItChanges) {
  EXPECT_THAT(warnings_of_strength(R"({"emissiveStrength":40})"), testing::IsEmpty());
  EXPECT_THAT(warnings_of_strength("{}"), testing::IsEmpty());
  EXPECT_THAT(
      warnings_of_strength(R"({"emissiveStrength":-40})"),
      testing::ElementsAre("material 0 'lamp': emissiveStrength -40 is outside 0 to 1e+12; the nearer of these is "
                           "taken"));
  EXPECT_THAT(warnings_of_strength(R"({"emissiveStrength":1e15})"),
              testing::ElementsAre(HasSubstr("outside 0 to 1e+12")));
  const auto many = warnings_of_strength(R"({"emissiveStrength":-40})", 100);
  EXPECT_LT(many.size(), 20u);
  EXPECT_THAT(many.back(), HasSubstr("92 more values of materials"));
}

TEST(GltfLoader, NamesAMaterialWhoseNumbersItReadsOtherwise) {
  const auto warnings = [](const std::string& members) {
    SmallScene s;
    s.primitive += R"(,"material":0)";
    s.more_members = R"(,"materials":[{"name":"odd",)" + members + "}]";
    return load(s).value()->warnings;
  };
  const auto pbr = [&](const std::string& member) { return warnings(R"("pbrMetallicRoughness":{)" + member + "}"); };
  const auto extension = [&](const std::string& name, const std::string& member) {
    return warnings(R"("extensions":{"KHR_materials_)" + name + R"(":{)" + member + "}}");
  };
  EXPECT_THAT(pbr(R"("roughnessFactor":1,"metallicFactor":0,"baseColorFactor":[0,0.5,1,1])"), testing::IsEmpty());
  EXPECT_THAT(extension("ior", R"("ior":0)"), testing::IsEmpty());
  EXPECT_THAT(
      pbr(R"("roughnessFactor":-3)"),
      testing::ElementsAre("material 0 'odd': roughnessFactor -3 is outside 0 to 1; the nearer of these is taken"));
  EXPECT_THAT(pbr(R"("baseColorFactor":[1,1,-1,1])"), testing::ElementsAre(HasSubstr("baseColorFactor -1")));
  EXPECT_THAT(pbr(R"("baseColorFactor":[1,1])"), testing::ElementsAre(HasSubstr("not a list of 4 numbers")));
  EXPECT_THAT(pbr(R"("baseColorFactor":0.5)"), testing::ElementsAre(HasSubstr("not a list of 4 numbers")));
  EXPECT_THAT(warnings(R"("emissiveFactor":[30,0,0])"), testing::ElementsAre(HasSubstr("emissiveFactor 30")));
  EXPECT_THAT(extension("ior", R"("ior":0.5)"), testing::ElementsAre(HasSubstr("ior 0.5 is outside 1 to 100")));
  EXPECT_THAT(warnings(R"("alphaMode":"X")"), testing::ElementsAre(HasSubstr("not OPAQUE, MASK or BLEND")));
  EXPECT_THAT(extension("transmission", R"("transmissionFactor":"1")"),
              testing::ElementsAre(HasSubstr("transmissionFactor is not a number; the default")));
}

// 27 characters of three bytes: a report is JSON, which takes no half of one.
TEST(GltfLoader, CutsLongNamesBetweenCharacters) {
  std::string name;
  for (int i = 0; i < 27; ++i) name += "\u5149";
  SmallScene s;
  s.primitive += R"(,"material":0)";
  s.more_members = R"(,"materials":[{"name":")" + name + R"(","emissiveFactor":[9,0,0]}])";
  const auto warnings = load(s).value()->warnings;
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], HasSubstr("material 0 '" + name.substr(0, 78) + "'"));
}

TEST(GltfLoader, NamesALightWhoseNumbersItReadsOtherwise) {
  EXPECT_THAT(warnings_of_light(R"("range":3)"), testing::IsEmpty());
  EXPECT_THAT(warnings_of_light(R"("range":-1)"),
              testing::ElementsAre("light 0 'lamp': range -1 is outside 0 to 1e+12; the nearer of these is taken"));
  EXPECT_THAT(warnings_of_light(R"("color":"red")"), testing::ElementsAre(HasSubstr("not a list of 3 numbers")));
}

TEST(GltfLoader, NamesACameraThatAnotherHides) {
  SmallScene s;
  s.nodes = R"([{"mesh":0},{"camera":0},{"camera":1}])";
  s.roots = "[0,1,2]";
  const std::string camera = R"({"name":"eye","type":"perspective","perspective":{"yfov":1,"znear":0.1}})";
  s.more_members = R"(,"cameras":[)" + camera + "," + camera + "]";
  EXPECT_THAT(load(s).value()->warnings,
              testing::ElementsAre("node 2 'eye' has a camera of a name that another has; the name means the first"));
}

TEST(GltfLoader, SaysWhyACameraIsLeftOut) {
  const auto warnings = [](const std::string& camera) {
    SmallScene s;
    s.nodes = R"([{"mesh":0},{"camera":0}])";
    s.roots = "[0,1]";
    s.more_members = R"(,"cameras":[)" + camera + "]";
    return load(s).value()->warnings;
  };
  EXPECT_THAT(warnings(R"({"type":"perspective","perspective":{"yfov":9,"znear":0.1}})"),
              testing::ElementsAre(HasSubstr("yfov outside 0 to pi")));
  EXPECT_THAT(warnings(R"({"type":"orthographic","orthographic":{"xmag":1,"ymag":1,"zfar":9,"znear":0.1}})"),
              testing::ElementsAre(HasSubstr("is not a perspective camera")));
}

TEST(GltfLoader, ReadsOnlyInsideItsFolder) {
  const auto folder = std::filesystem::temp_directory_path() / "darm_scene_sandbox";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder / "inside");
  std::ofstream(folder / "secret.bin") << std::string(36, 'x');
  std::filesystem::create_symlink(folder / "secret.bin", folder / "inside/link.bin");
  const auto message = [&](const std::string& uri) {
    std::ofstream(folder / "inside/a.gltf")
        << R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":36,"uri":")" + uri + R"("}]})";
    return load_scene(folder / "inside/a.gltf", {}).error().message;
  };
  EXPECT_THAT(message("../secret.bin"), HasSubstr("leads out of"));
  EXPECT_THAT(message("%2e%2e/secret.bin"), HasSubstr("leads out of"));
  EXPECT_THAT(message("/etc/passwd"), HasSubstr("leads out of"));
  EXPECT_THAT(message("link.bin"), HasSubstr("leads out of"));
  EXPECT_THAT(message("file:///etc/passwd"), HasSubstr("only data URIs"));
  EXPECT_THAT(message("http://localhost/x"), HasSubstr("only data URIs"));
  EXPECT_THAT(message("/dev/zero"), HasSubstr("leads out of"));
  EXPECT_THAT(message("."), HasSubstr("not a regular file"));
  std::filesystem::remove_all(folder);
}

TEST(GltfLoader, MakesTangentsThatSurviveDegenerateUvs) {
  // A 1x1 grey PNG as the normal map; two triangles, the second with all its UVs in one point.
  SmallScene s;
  s.positions = {0, 0, 0, 1, 0, 0, 0, 1, 0, /**/ 2, 0, 0, 3, 0, 0, 2, 1, 0};
  append(s.more_binary, std::vector<float>{0, 1, 1, 1, 0, 0, /**/ 0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f});
  s.more_views = R"(,{"buffer":0,"byteOffset":72,"byteLength":48})";
  s.more_accessors = R"(,{"bufferView":1,"componentType":5126,"type":"VEC2","count":6})";
  s.primitive = R"("attributes":{"POSITION":0,"TEXCOORD_0":1},"material":0)";
  s.more_members =
      R"(,"materials":[{"normalTexture":{"index":0}}],"textures":[{"source":0}],"images":[{"uri":"data:image/png;base64,)"
      R"(iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNkYPhfDwAChwGA60e6kgAAAABJRU5ErkJggg=="}])";
  const auto loaded = load(s);
  ASSERT_TRUE(loaded) << loaded.error().message;
  const Mesh& m = (*loaded)->meshes.at(0);
  ASSERT_EQ(m.tangents.size(), m.positions.size());
  for (std::size_t i = 0; i < m.tangents.size(); ++i) {
    const glm::vec3 t(m.tangents[i]);
    EXPECT_NEAR(glm::dot(t, t), 1.0f, 1e-5f);
    EXPECT_NEAR(glm::dot(t, m.normals[i]), 0.0f, 1e-5f);
  }
  // u grows along +X and the image stands upright (v downwards): the bitangent cross(n, t) * w points up.
  EXPECT_NEAR(m.tangents[m.triangles[0].x].x, 1.0f, 1e-5f);
  EXPECT_EQ(m.tangents[m.triangles[0].x].w, 1.0f);
}

TEST(GltfLoader, RefusesABigImageBeforeItTakesMemory) {
  // A PNG header that declares 60000 x 60000 pixels.
  SmallScene s;
  s.more_members = R"(,"images":[{"name":"huge","uri":"data:image/png;base64,)"
                   R"(iVBORw0KGgoAAAANSUhEUgAA6mAAAOpgCAYAAAA="}])";
  EXPECT_THAT(load(s).error().message, HasSubstr("image 0 'huge' is"));
}

}  // namespace
}  // namespace darm::scene::test
