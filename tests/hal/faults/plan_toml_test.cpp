// Files of faults: what they may say, and the sentences for what they may not.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "hal/faults/faults.hpp"

namespace tactus::hal::faults {
namespace {

Fault only_fault(const std::string& text) {
  const auto plan = parse_faults("[[fault]]\n" + text, "plan.toml");
  EXPECT_TRUE(plan) << plan.error().message;
  EXPECT_EQ(plan->faults.size(), 1U);
  return plan->faults.at(0);
}

std::string complaint(const std::string& text) {
  const auto plan = parse_faults(text, "plan.toml");
  EXPECT_FALSE(plan) << text;
  if (plan) return {};
  EXPECT_EQ(plan.error().code, rt::ExitCode::bad_usage);
  return plan.error().message;
}

TEST(ParseFaults, EmptyFileHasNoFaults) {
  const auto plan = parse_faults("", "plan.toml");
  ASSERT_TRUE(plan);
  EXPECT_TRUE(plan->faults.empty());
  EXPECT_EQ(plan->seed, 1U);
}

TEST(ParseFaults, SeedAndOrderAreKept) {
  const auto plan = parse_faults(
      "seed = 7\n[[fault]]\nkind = \"drop\"\nfirst = 3\n"
      "[[fault]]\nkind = \"late\"\nevery = 4\ndelay_ms = 40\n", "plan.toml");
  ASSERT_TRUE(plan) << plan.error().message;
  EXPECT_EQ(plan->seed, 7U);
  ASSERT_EQ(plan->faults.size(), 2U);
  EXPECT_EQ(plan->faults[0].kind, FaultKind::drop);
  EXPECT_EQ(plan->faults[1].kind, FaultKind::late);
  EXPECT_EQ(plan->faults[1].delay.ns, 40'000'000);
}

TEST(ParseFaults, FirstAloneIsOneFrame) {
  const Fault fault = only_fault("kind = \"drop\"\nfirst = 30\n");
  EXPECT_EQ(fault.first, 30U);
  EXPECT_EQ(fault.every, 1U);
  EXPECT_EQ(fault.count, 1U);
  EXPECT_TRUE(fault.hits_depth && fault.hits_color);
}

TEST(ParseFaults, EveryBeginsWithItselfAndDoesNotEnd) {
  const Fault fault = only_fault("kind = \"drop\"\nstream = \"depth\"\nevery = 10\n");
  EXPECT_EQ(fault.first, 10U);
  EXPECT_EQ(fault.every, 10U);
  EXPECT_EQ(fault.count, Fault::kEndless);
  EXPECT_TRUE(fault.hits_depth);
  EXPECT_FALSE(fault.hits_color);
}

TEST(ParseFaults, ProbabilityIsOfEveryFrame) {
  const Fault fault = only_fault("kind = \"half_frame\"\nstream = \"color\"\nprobability = 0.25\n");
  EXPECT_EQ(fault.probability, 0.25);
  EXPECT_EQ(fault.first, 0U);
  EXPECT_EQ(fault.count, Fault::kEndless);
  EXPECT_FALSE(fault.hits_depth);
}

TEST(ParseFaults, NumbersOfAKindHaveUnits) {
  EXPECT_EQ(only_fault("kind = \"clock_jump\"\nfirst = 1\njump_ms = -500\n").jump.ns, -500'000'000);
  EXPECT_EQ(only_fault("kind = \"slow_consumer\"\nfirst = 1\ndelay_ms = 0.5\n").delay.ns, 500'000);
  EXPECT_EQ(only_fault("kind = \"corrupt_bytes\"\nfirst = 1\n").share, 0.01);
  EXPECT_EQ(only_fault("kind = \"corrupt_bytes\"\nfirst = 1\nshare = 1\n").share, 1);
  EXPECT_EQ(only_fault("kind = \"unplug\"\nfirst = 1\naway_frames = 45\n").away_frames, 45U);
  EXPECT_EQ(only_fault("kind = \"unplug\"\nfirst = 1\naway_ms = 1500\n").away.ns, 1'500'000'000);
}

TEST(ParseFaults, ColourWithoutDepthHitsDepthAlone) {
  const Fault fault = only_fault("kind = \"color_without_depth\"\nfirst = 1\n");
  EXPECT_TRUE(fault.hits_depth);
  EXPECT_FALSE(fault.hits_color);
}

TEST(ParseFaults, WrongFilesAreOneSentenceWithTheLine) {
  EXPECT_EQ(complaint("sead = 1\n"),
            "plan.toml:1: 'sead' is no key of a file of faults; it holds seed and tables [[fault]].");
  EXPECT_EQ(complaint("seed = -1\n"), "plan.toml:1: seed must be a whole number from 0 to 1000000000.");
  EXPECT_EQ(complaint("[[fault]]\nfirst = 1\n"), "plan.toml:1: kind is missing.");
  EXPECT_EQ(complaint("\n[[fault]]\nkind = \"drop\"\n"),
            "plan.toml:2: first, every or probability says which frames are hit.");
  EXPECT_EQ(complaint("[[fault]]\nkind = \"drop\"\nfirst = 1\noften = true\n"),
            "plan.toml:4: 'often' is no key of [[fault]].");
  EXPECT_EQ(complaint("[[fault]]\nkind = \"drop\"\nfirst = 1.5\n"),
            "plan.toml:3: first must be a whole number from 0 to 1000000000.");
  EXPECT_EQ(complaint("[[fault]]\nkind = \"drop\"\nevery = 0\n"),
            "plan.toml:3: every must be a whole number from 1 to 1000000000.");
  EXPECT_EQ(complaint("[[fault]]\nkind = \"drop\"\nprobability = 1.5\n"),
            "plan.toml:3: probability must be a number from 0 to 1.");
  EXPECT_EQ(complaint("[[fault]]\nkind = \"drop\"\nfirst = 1\nstream = \"left\"\n"),
            "plan.toml:4: stream must be one of depth, color, both.");
  EXPECT_EQ(complaint("[[fault]]\nkind = \"drop\"\nfirst = 1\ndelay_ms = 4\n"),
            "plan.toml:1: delay_ms says nothing to a fault of kind drop.");
  EXPECT_EQ(complaint("[[fault]]\nkind = \"late\"\nfirst = 1\n"), "plan.toml:1: delay_ms is missing.");
  EXPECT_EQ(complaint("[[fault]]\nkind = \"clock_jump\"\nfirst = 1\njump_ms = 0\n"),
            "plan.toml:1: jump_ms is missing, or 0.");
  EXPECT_EQ(complaint("[[fault]]\nkind = \"unplug\"\nfirst = 1\n"),
            "plan.toml:1: one of away_frames and away_ms says for how long it is away.");
  EXPECT_EQ(complaint("[[fault]]\nkind = \"unplug\"\nfirst = 1\naway_ms = 3\naway_frames = 3\n"),
            "plan.toml:1: one of away_frames and away_ms says for how long it is away.");
  EXPECT_EQ(complaint("[[fault]]\nkind = \"color_without_depth\"\nfirst = 1\nstream = \"color\"\n"),
            "plan.toml:1: color_without_depth is a fault of the depth stream.");
  EXPECT_EQ(complaint("fault = 3\n"), "plan.toml:1: fault must be 1 to 64 tables [[fault]].");
  EXPECT_EQ(complaint("fault = [1, 2]\n"), "plan.toml:1: fault must be 1 to 64 tables [[fault]].");
  EXPECT_NE(complaint("[[fault]]\nkind = \"gremlin\"\nfirst = 1\n").find("plan.toml:2: kind must be one of drop, duplicate"),
            std::string::npos);
  EXPECT_NE(complaint("[[fault\n").find("plan.toml:1: not valid TOML"), std::string::npos);
}

TEST(LoadFaults, FileThatIsNotThereIsOneSentence) {
  const auto plan = load_faults("nowhere/plan.toml");
  ASSERT_FALSE(plan);
  EXPECT_EQ(plan.error().message, "nowhere/plan.toml: the file of faults cannot be read");
}

TEST(LoadFaults, CommittedPlansHaveOneFileForEveryKind) {
  const std::filesystem::path plans = std::filesystem::path(TACTUS_SOURCE_DIR) / "tests/hal/faults/plans";
  for (std::size_t kind = 0; kind < kFaultKinds; ++kind) {
    const auto plan = load_faults((plans / (std::string(kFaultNames[kind]) + ".toml")).string());
    ASSERT_TRUE(plan) << plan.error().message;
    ASSERT_EQ(plan->faults.size(), 1U) << kFaultNames[kind];
    EXPECT_EQ(static_cast<std::size_t>(plan->faults[0].kind), kind);
  }
  const auto all = load_faults((plans / "all.toml").string());
  ASSERT_TRUE(all) << all.error().message;
  EXPECT_EQ(all->faults.size(), kFaultKinds);
}

}  // namespace
}  // namespace tactus::hal::faults
