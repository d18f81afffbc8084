#include "client/core/scene_model.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "client/core/view.hpp"
#include "tests/unit/client/synthetic.hpp"

namespace darm::client {
namespace {

TEST(SceneModel, TakesManifestAndChunk) {
  auto scene = SceneModel::from_manifest(synthetic::manifest());
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_FALSE(scene->complete());
  ASSERT_TRUE(scene->add_chunk(synthetic::square_chunk()));
  EXPECT_TRUE(scene->complete());
  EXPECT_EQ(scene->triangles(), 2u);
  EXPECT_EQ(scene->tile_count(), 9u + 4u + 1u);
  EXPECT_EQ(scene->places()[1].x, 5u);
  std::uint32_t entry = 0;
  EXPECT_TRUE(scene->page_entry(1u << 28 | 3, entry));
  EXPECT_EQ(entry, 12u);
  EXPECT_FALSE(scene->page_entry(1u << 28 | 4, entry));
  EXPECT_FALSE(scene->page_entry(3u << 28, entry));
}

TEST(SceneModel, TakesVerticesOffTheGrid) {
  auto scene = SceneModel::from_manifest(synthetic::manifest());
  ASSERT_TRUE(scene);
  auto chunk = synthetic::square_chunk();
  chunk.set_uv_step(0.5f);
  ASSERT_TRUE(scene->add_chunk(chunk));
  const auto& last = scene->chunks()[0].vertices[2];
  EXPECT_EQ(last.position, (std::array<float, 3>{2, 2, 0}));
  EXPECT_EQ(last.uv, (std::array<float, 2>{4, 4}));
}

TEST(SceneModel, RefusesHostileManifests) {
  using Change = void (*)(wire::SceneManifest&);
  const Change changes[] = {
      [](auto& m) { m.clear_levels(); },
      [](auto& m) { m.set_q(0); },
      [](auto& m) { m.set_q(std::numeric_limits<float>::quiet_NaN()); },
      [](auto& m) { m.mutable_levels(0)->set_width(91); },
      [](auto& m) { m.mutable_levels(0)->set_density(-1); },
      [](auto& m) {
        auto& l = *m.mutable_levels(0);
        l.set_tiles_x(100000000);
        l.set_tiles_y(100000000);
        l.set_width(100000000u * 30u);
      },
      [](auto& m) { m.set_patch_count(0); },
      [](auto& m) { m.set_patch_count(4000000); },
      [](auto& m) { m.set_patch_table("short"); },
      [](auto& m) { m.set_patch_table(synthetic::pack_vertices(std::vector<PatchPlace>(3, {5000, 0, 1}))); },
      [](auto& m) { m.set_patch_table(synthetic::pack_vertices(std::vector<PatchPlace>(3, {0, 0, INFINITY}))); },
      [](auto& m) { m.mutable_instances(0)->set_chart(1); },
      [](auto& m) { m.mutable_instances(0)->set_front_base(1); },
      [](auto& m) { m.mutable_instances(0)->set_back_base(7); },
      [](auto& m) { m.mutable_instances(0)->set_to_world(3, NAN); },
      [](auto& m) { m.mutable_instances(0)->mutable_to_world()->RemoveLast(); },
      [](auto& m) { m.mutable_instances(0)->set_alpha_mode(3); },
      [](auto& m) { m.mutable_bounds()->RemoveLast(); },
      [](auto& m) { m.set_coarse_coverage("short"); },
      [](auto& m) { m.set_coarse_coverage(synthetic::deflate(std::string(899, '0'))); },
      [](auto& m) { m.set_coarse_coverage(synthetic::deflate(std::string(901, '0'))); },
      [](auto& m) {  // more than CoarseTex can be, though its bytes would fit
        auto& last = *m.mutable_levels(m.levels_size() - 1);
        last.set_tiles_x(70), last.set_tiles_y(70), last.set_width(2100), last.set_height(2100);
        m.set_coarse_coverage(synthetic::deflate(std::string(std::size_t{2100} * 2100, '0')));
      },
      [](auto& m) { m.mutable_origin()->set_x(INFINITY); },
      [](auto& m) { m.add_sun(1); },
      [](auto& m) { m.set_geometry_chunks(0xffffffffu); },
      [](auto& m) { m.set_chart_count(0xffffffffu); },
  };
  int number = 0;
  for (const auto change : changes) {
    auto manifest = synthetic::manifest();
    change(manifest);
    const auto scene = SceneModel::from_manifest(manifest);
    EXPECT_FALSE(scene) << "change " << number;
    if (!scene) {
      EXPECT_FALSE(scene.error().message.empty());
    }
    ++number;
  }
}

TEST(SceneModel, RefusesHostileChunksAndStaysAsItWas) {
  using Change = void (*)(wire::GeometryChunk&);
  const Change changes[] = {
      [](auto& c) { c.set_index(1); },
      [](auto& c) { c.set_chart(1); },
      [](auto& c) { c.set_vertex_count(3); },
      [](auto& c) { c.set_vertex_count(0xffffffffu); },
      [](auto& c) { c.set_index_count(5); },
      [](auto& c) { c.set_index_count(0xfffffffcu); },
      [](auto& c) { c.set_vertices("garbage"); },
      [](auto& c) { c.set_indices("garbage"); },
      [](auto& c) { c.set_vertices(synthetic::deflate("garbage")); },
      [](auto& c) { c.set_vertices(synthetic::deflate(std::string(1 << 20, 'x'))); },
      [](auto& c) { c.set_indices(synthetic::deflate(std::string(1 << 20, 'x'))); },
      [](auto& c) {
        c.set_vertices(synthetic::pack_vertices(std::vector<synthetic::GridVertex>(4, {{0, 0, 0}, {0, 0}, 1})));
      },
      [](auto& c) { c.set_position_step(NAN); },
      [](auto& c) { c.set_uv_step(INFINITY); },
      [](auto& c) { c.set_position_step(3e38f); },
      [](auto& c) { c.set_indices(synthetic::pack_indices({0, 1, 2, 0, 2, 9}, 10)); },
  };
  auto scene = SceneModel::from_manifest(synthetic::manifest());
  ASSERT_TRUE(scene);
  int number = 0;
  for (const auto change : changes) {
    auto chunk = synthetic::square_chunk();
    change(chunk);
    EXPECT_FALSE(scene->add_chunk(chunk)) << "change " << number++;
    EXPECT_TRUE(scene->chunks().empty());
  }
  ASSERT_TRUE(scene->add_chunk(synthetic::square_chunk()));
  EXPECT_FALSE(scene->add_chunk(synthetic::square_chunk())) << "twice";
}

TEST(View, PoseTravelsAndBadPosesAreRefused) {
  const View view = look_at({1, 2, 3}, {4, 5, 6}, 60, 640, 480);
  View back;
  ASSERT_TRUE(from_pose(to_pose(view), back));
  EXPECT_NEAR(glm::dot(view.orientation, back.orientation), 1, 1e-6);
  auto pose = to_pose(view);
  pose.set_fovy(NAN);
  EXPECT_FALSE(from_pose(pose, back));
  pose = to_pose(view);
  pose.set_qw(5);
  EXPECT_FALSE(from_pose(pose, back));
  EXPECT_TRUE(from_pose(to_pose(look_at({0, 0, 0}, {0, 5, 0}, 60, 10, 10)), back));
}

TEST(View, TargetLandsInTheMiddleOfThePicture) {
  const View view = look_at({100001, 2, 3}, {100004, 5, 6}, 60, 640, 480);
  const auto clip =
      projection_matrix(view, 0.1, 100, false) * view_matrix(view, {100000, 0, 0}) * glm::dvec4(4, 5, 6, 1);
  EXPECT_NEAR(clip.x / clip.w, 0, 1e-9);
  EXPECT_NEAR(clip.y / clip.w, 0, 1e-9);
  EXPECT_GT(clip.w, 0);
}

TEST(SceneModel, OneModelReadsWhatAnotherKeeps) {
  auto reader = SceneModel::from_manifest(synthetic::manifest());
  ASSERT_TRUE(reader);
  SceneModel keeper = *reader;
  auto chunk = reader->read_chunk(synthetic::square_chunk());
  ASSERT_TRUE(chunk);
  EXPECT_TRUE(reader->all_read());
  EXPECT_FALSE(reader->complete()) << "it keeps nothing";
  EXPECT_FALSE(reader->read_chunk(synthetic::square_chunk())) << "twice";
  keeper.keep_chunk(std::move(*chunk));
  EXPECT_TRUE(keeper.complete());
  EXPECT_EQ(keeper.triangles(), 2u);
}

}  // namespace
}  // namespace darm::client
