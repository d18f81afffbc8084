#include "daemon/config/load.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>

namespace darm::config {
namespace {

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

const std::filesystem::path kDocumented = DARM_SOURCE_DIR "/config/darmd.toml";

// All faults of `toml`, one string each; empty if it loads.
std::vector<std::string> faults_of(const std::string& toml) {
  std::vector<std::string> lines;
  const auto loaded = parse(toml, "dir/a.toml");
  if (!loaded)
    for (const auto& fault : loaded.error()) lines.push_back(fault.to_string());
  return lines;
}

// The documented file with its examples switched on: "# key = value" and "# [section]" lose their "# ".
std::string with_examples() {
  std::istringstream in(text_of(kDocumented));
  std::string all;
  const std::regex example(R"(^# (\[.*\]|[a-z_0-9]+ = .*)$)");
  for (std::string line; std::getline(in, line);) {
    std::smatch match;
    all += (std::regex_match(line, match, example) ? match[1].str() : line) + "\n";
  }
  return all;
}

TEST(DocumentedConfig, EqualsTheDefaults) {
  const std::vector<std::filesystem::path> files{kDocumented};
  const auto loaded = load(files);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  const Config& a = *loaded;
  const Config b;
  EXPECT_EQ(a.scene.file, b.scene.file);
  EXPECT_EQ(a.scene.q, b.scene.q);
  EXPECT_EQ(a.scene.exposure, b.scene.exposure);
  EXPECT_FALSE(a.sun || a.sky);
  EXPECT_TRUE(a.lights.empty() && a.cameras.empty() && a.load_cameras.empty() && a.load_groups.empty());
  EXPECT_EQ(a.walkthrough, b.walkthrough);
  EXPECT_EQ(a.atlas.max_texels, b.atlas.max_texels);
  EXPECT_EQ(a.render.threads, b.render.threads);
  EXPECT_EQ(a.render.max_samples, b.render.max_samples);
  EXPECT_EQ(a.render.slice_ms, b.render.slice_ms);
  EXPECT_EQ(a.accuracy.preset, b.accuracy.preset);
  EXPECT_EQ(a.accuracy.target, b.accuracy.target);
  EXPECT_EQ(a.accuracy.indirect, b.accuracy.indirect);
  EXPECT_EQ(a.accuracy.filter_samples, b.accuracy.filter_samples);
  EXPECT_EQ(a.accuracy.client_target_min, b.accuracy.client_target_min);
  EXPECT_EQ(a.stream.updates_per_second, b.stream.updates_per_second);
  EXPECT_EQ(a.stream.phystex, b.stream.phystex);
  EXPECT_EQ(a.stream.view_phystex, b.stream.view_phystex);
  EXPECT_EQ(a.stream.max_writes, b.stream.max_writes);
  EXPECT_EQ(a.stream.crf, b.stream.crf);
  EXPECT_EQ(a.stream.crf_finest, b.stream.crf_finest);
  EXPECT_EQ(a.stream.share, b.stream.share);
  EXPECT_EQ(a.stream.preset, b.stream.preset);
  EXPECT_EQ(a.stream.chroma_444, b.stream.chroma_444);
  EXPECT_EQ(a.stream.allow_lossless, b.stream.allow_lossless);
  EXPECT_EQ(a.session.max_sessions, b.session.max_sessions);
  EXPECT_EQ(a.session.max_sessions_per_address, b.session.max_sessions_per_address);
  EXPECT_EQ(a.session.max_memory_bytes, b.session.max_memory_bytes);
  EXPECT_EQ(a.session.handshake_timeout_s, b.session.handshake_timeout_s);
  EXPECT_EQ(a.session.idle_timeout_s, b.session.idle_timeout_s);
  EXPECT_EQ(a.session.send_queue_bytes, b.session.send_queue_bytes);
  EXPECT_EQ(a.session.send_queue_seconds, b.session.send_queue_seconds);
  EXPECT_EQ(a.listen.address, b.listen.address);
  EXPECT_EQ(a.listen.tcp_port, b.listen.tcp_port);
  EXPECT_EQ(a.listen.udp_port, b.listen.udp_port);
  EXPECT_EQ(a.listen.http_port, b.listen.http_port);
  EXPECT_EQ(a.listen.metrics_port, b.listen.metrics_port);
  EXPECT_EQ(a.web.origins, b.web.origins);
  EXPECT_EQ(a.tls.enabled, b.tls.enabled);
  EXPECT_EQ(a.tls.certificate, b.tls.certificate);
  EXPECT_EQ(a.tls.key, b.tls.key);
  EXPECT_EQ(a.tls.names, b.tls.names);
  EXPECT_EQ(a.state.dir, b.state.dir);
  EXPECT_EQ(a.state.max_store_bytes, b.state.max_store_bytes);
  EXPECT_EQ(a.log.level, b.log.level);
  EXPECT_EQ(a.log.json, b.log.json);
}

TEST(DocumentedConfig, ExamplesLoadAndEqualTheDefaultsOfTheirSections) {
  const auto loaded = parse(with_examples(), kDocumented);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  ASSERT_TRUE(loaded->sun && loaded->sky);
  EXPECT_EQ(loaded->sun->direction, SunConfig().direction);
  EXPECT_EQ(loaded->sun->irradiance, SunConfig().irradiance);
  EXPECT_EQ(loaded->sun->angular_diameter_degrees, SunConfig().angular_diameter_degrees);
  EXPECT_EQ(loaded->sky->zenith, SkyConfig().zenith);
  EXPECT_EQ(loaded->sky->ground, SkyConfig().ground);
  EXPECT_EQ(loaded->lights.size(), 1u);
  EXPECT_EQ(loaded->cameras.size(), 1u);
}

// Every key the reader asks for stands in its section of the file, as a value or as an example.
TEST(DocumentedConfig, MentionsEveryKey) {
  std::istringstream in(with_examples());
  std::string section;
  std::vector<std::string> mentioned;
  const std::regex header(R"(^\[?\[([a-z_0-9]+)\]\]?$)");
  const std::regex key(R"(^([a-z_0-9]+) = .*$)");
  for (std::string line; std::getline(in, line);) {
    std::smatch match;
    if (std::regex_match(line, match, header)) section = match[1].str() + (line.starts_with("[[") ? "[]." : ".");
    if (std::regex_match(line, match, key)) mentioned.push_back(section + match[1].str());
  }
  const auto known = known_keys();
  EXPECT_GT(known.size(), 40u);
  for (const auto& name : known)
    EXPECT_TRUE(std::find(mentioned.begin(), mentioned.end(), name) != mentioned.end()) << name << " is not documented";
}

TEST(LoadConfig, AnEmptyPathIsAFaultAndNotAKeyThatIsLeftOut) {
  for (const char* toml : {"[scene]\nfile = \"\"", "walkthrough = \"\"", "[tls]\nkey = \"\""}) {
    const auto loaded = parse(toml, "a.toml");
    ASSERT_FALSE(loaded) << toml;
    EXPECT_NE(to_string(loaded.error()).find("is empty"), std::string::npos) << to_string(loaded.error());
  }
  EXPECT_EQ(to_string(parse("[scene]\nfile = \"\"", "a.toml").error()),
            "a.toml:2: scene.file: is empty; leave the key out where there is no file");
}

TEST(LoadConfig, AnAddressIsOneInNumbers) {
  Config config;
  for (const char* good : {"0.0.0.0", "127.0.0.1", "::", "::1", "fe80::1%eth0"}) {
    config.listen.address = good;
    EXPECT_TRUE(check(config).empty()) << good;
  }
  for (const char* bad : {"nonsense", "localhost", "1.2.3", "1.2.3.4:80", "1.2.3.4%eth0", ":::", " 127.0.0.1"}) {
    config.listen.address = bad;
    const auto faults = to_string(check(config));
    EXPECT_NE(faults.find("listen.address: \"" + std::string(bad) + "\" is not an IP address"), std::string::npos)
        << faults;
  }
}

TEST(LoadConfig, EvaluationSetUpsLoad) {
  for (const auto& entry : std::filesystem::directory_iterator(DARM_SOURCE_DIR "/config/scenes")) {
    if (entry.path().extension() != ".toml") continue;
    const std::vector<std::filesystem::path> files{kDocumented, entry.path()};
    const auto loaded = load(files);
    EXPECT_TRUE(loaded) << to_string(loaded.error());
    if (!loaded) continue;
    EXPECT_GE(loaded->cameras.size(), 1u) << entry.path();
    if (!loaded->walkthrough.empty()) {
      EXPECT_TRUE(std::filesystem::exists(loaded->walkthrough)) << loaded->walkthrough;
    }
  }
}

TEST(LoadConfig, AllFaultsAreReportedAtOnceWithLineKeyValueAndRange) {
  const auto faults = faults_of(
      "[stream]\n"
      "crf = 99\n"
      "phystex = 3000\n"
      "preset = \"fastest\"\n"
      "[session]\n"
      "max_sesions = 3\n"
      "idle_timeout_s = nan\n"
      "[[cameras]]\n"
      "name = \"a\"\n"
      "position = [1, 2]\n"
      "[colour]\n");
  ASSERT_EQ(faults.size(), 8u) << ::testing::PrintToString(faults);
  const auto has = [&](const std::string& line) {
    EXPECT_TRUE(std::find(faults.begin(), faults.end(), line) != faults.end()) << line << "\nis not among\n"
                                                                               << ::testing::PrintToString(faults);
  };
  has("dir/a.toml:2: stream.crf: 99 is not a whole number from 0 to 51");
  has("dir/a.toml:3: stream.phystex: 3000 is not one of 1024, 2048, 4096");
  has("dir/a.toml:4: stream.preset: \"fastest\" is not one of ultrafast, superfast, veryfast, faster, fast, medium, "
      "slow, "
      "slower, veryslow");
  has("dir/a.toml:6: session.max_sesions: unknown key; did you mean max_sessions?");
  has("dir/a.toml:7: session.idle_timeout_s: nan is not a number from 1 to 86400");
  has("dir/a.toml:10: cameras[0].position: a list of 2 is not a list of three numbers from -10000000 to 10000000");
  has("dir/a.toml:8: cameras[0].target: is missing");
}

TEST(LoadConfig, SyntaxErrorNamesItsLine) {
  const auto faults = faults_of("[log]\nlevel = \n");
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_TRUE(faults[0].starts_with("dir/a.toml:2: not TOML: ")) << faults[0];
}

TEST(LoadConfig, WrongTypesAreFaults) {
  for (const char* toml : {"scene = 3\n", "cameras = 3\n", "cameras = [3]\n", "[log]\njson = 1\n", "[log]\nlevel = 3\n",
                           "[render]\nthreads = 1.5\n", "[render]\nslice_ms = \"4\"\n", "[scene]\nq = \"fine\"\n",
                           "[sun]\ndirection = [0, 0, 0]\n", "[sky]\nzenith = [1, 2, inf]\n", "[sky]\nzenith = -1\n",
                           "[scene]\nq = 1979-05-27\n", "[state]\ndir = \"\"\n", "[[lights]]\nkind = \"sun\"\n"})
    EXPECT_FALSE(faults_of(toml).empty()) << toml;
}

TEST(LoadConfig, PathsAreRelativeToTheFileThatNamesThem) {
  const auto loaded = parse("walkthrough = \"../w.json\"\n[scene]\nfile = \"s.glb\"\n", "a/b/c.toml");
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->walkthrough, "a/w.json");
  EXPECT_EQ(loaded->scene.file, "a/b/s.glb");
  EXPECT_EQ(parse("[scene]\nfile = \"/x/s.glb\"\n", "c.toml")->scene.file, "/x/s.glb");
}

TEST(LoadConfig, NumberOrAutoAndGreyOrColour) {
  const auto loaded = parse("[scene]\nq = 64\nexposure = \"auto\"\n[sun]\nirradiance = 5\n", "a.toml");
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->scene.q, 64);
  EXPECT_EQ(loaded->scene.exposure, 0);
  EXPECT_EQ(loaded->sun->irradiance, glm::dvec3(5));
}

TEST(LoadConfig, SpotsNeedADirectionAndNestedCones) {
  const std::string base = "[[lights]]\nkind = \"spot\"\nposition = [0,0,0]\nintensity = 3\n";
  EXPECT_EQ(faults_of(base), std::vector<std::string>{"dir/a.toml:1: lights[0].direction: is missing"});
  EXPECT_TRUE(faults_of(base + "direction = [0,-1,0]\ncone = 30\ninner_cone = 20\n").empty());
  EXPECT_FALSE(faults_of(base + "direction = [0,-1,0]\ncone = 30\ninner_cone = 30\n").empty());
}

TEST(LoadConfig, LaterFilesOverrideKeysAndReplaceLists) {
  const auto dir = std::filesystem::temp_directory_path() / "darm_config_test";
  std::filesystem::create_directories(dir);
  const std::string camera = "[[cameras]]\nposition = [0,0,0]\ntarget = [1,0,0]\nname = ";
  std::ofstream(dir / "one.toml") << "[stream]\ncrf = 20\npreset = \"fast\"\n" + camera + "\"a\"\n" + camera +
                                         "\"b\"\n";
  std::ofstream(dir / "two.toml") << "[stream]\ncrf = 30\n" + camera + "\"c\"\n";
  const std::vector<std::filesystem::path> files{dir / "one.toml", dir / "two.toml"};
  const auto loaded = load(files);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(loaded->stream.crf, 30u);
  EXPECT_EQ(loaded->stream.preset, "fast");
  ASSERT_EQ(loaded->cameras.size(), 1u);
  EXPECT_EQ(loaded->cameras[0].name, "c");
  std::filesystem::remove_all(dir);
}

TEST(LoadConfig, APresetSetsItsKnobsAndAKnobHasTheLastWord) {
  const auto preview = parse("[accuracy]\npreset = \"preview\"\n", "a.toml");
  ASSERT_TRUE(preview);
  EXPECT_EQ(preview->accuracy.target, 0.01);
  EXPECT_EQ(preview->accuracy.indirect, "stored");
  const auto reference = parse("[accuracy]\nfilter_samples = 12\npreset = \"reference\"\n", "a.toml");
  ASSERT_TRUE(reference);
  EXPECT_EQ(reference->accuracy.target, 0.0005);
  EXPECT_EQ(reference->accuracy.indirect, "traced");
  EXPECT_EQ(reference->accuracy.filter_samples, 12u) << "whichever comes first in the file";
  EXPECT_FALSE(parse("[accuracy]\npreset = \"best\"\n", "a.toml"));
}

TEST(LoadConfig, MissingAndOversizedFilesAreFaults) {
  const auto big = std::filesystem::temp_directory_path() / "darm_config_big.toml";
  std::ofstream(big) << std::string((1u << 20) + 1, '#');
  const std::vector<std::filesystem::path> files{"/nowhere/x.toml", big, std::filesystem::temp_directory_path()};
  const auto loaded = load(files);
  ASSERT_FALSE(loaded);
  ASSERT_EQ(loaded.error().size(), 3u);
  EXPECT_TRUE(loaded.error()[2].text.starts_with("is a directory")) << loaded.error()[2].text;
  std::filesystem::remove(big);
}

TEST(CheckConfig, ACertificateComesWithItsKey) {
  const auto faults = faults_of("[tls]\ncertificate = \"a.pem\"\n");
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_TRUE(faults[0].find("tls.key: is missing") != std::string::npos) << faults[0];
  const auto both = parse("[tls]\ncertificate = \"a.pem\"\nkey = \"/b.pem\"\nnames = [\"x.org\"]\n", "dir/a.toml");
  ASSERT_TRUE(both) << to_string(both.error());
  EXPECT_EQ(both->tls.certificate, "dir/a.pem");
  EXPECT_EQ(both->tls.key, "/b.pem");
  EXPECT_EQ(both->tls.names, std::vector<std::string>{"x.org"});
}

TEST(CheckConfig, ListsOfTextsHoldTextsOnly) {
  EXPECT_EQ(faults_of("[web]\norigins = [\"https://a.org\", 3]\n").size(), 1u);
  EXPECT_EQ(faults_of("[web]\norigins = \"https://a.org\"\n").size(), 1u);
  EXPECT_EQ(faults_of("[web]\norigins = [\"" + std::string(301, 'a') + "\"]\n").size(), 1u);
  EXPECT_TRUE(faults_of("[web]\norigins = [\"https://a.org\", \"*\"]\n").empty());
}

TEST(CheckConfig, KeysThatChangeNothingAreUnknown) {
  EXPECT_EQ(faults_of("[session]\nmax_message_bytes = 65536\n").size(), 1u)
      << "the protocol fixes it: proto/limits.hpp";
}

TEST(CheckConfig, PortsAndNamesMustDiffer) {
  EXPECT_EQ(faults_of("[listen]\ntcp_port = 7\nmetrics_port = 7\n").size(), 1u);
  EXPECT_EQ(faults_of("[listen]\ntcp_port = 7\nhttp_port = 7\n").size(), 1u);
  EXPECT_EQ(faults_of("[listen]\nhttp_port = 9090\n").size(), 1u) << "metrics are there";
  EXPECT_TRUE(faults_of("[listen]\ntcp_port = 0\nmetrics_port = 0\nhttp_port = 0\n").empty());
  const std::string camera = "[[cameras]]\nname = \"a\"\nposition = [0,0,0]\ntarget = [1,0,0]\n";
  EXPECT_EQ(faults_of(camera + camera).size(), 1u);
}

}  // namespace
}  // namespace darm::config
