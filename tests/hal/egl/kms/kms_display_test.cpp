// What can be said of it without a screen: how one is chosen, and that create() says why there is none.
#include "hal/egl/kms_display.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <vector>

#include "hal/egl/kms/screen.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::hal::egl {
namespace {

drmModeModeInfo mode(std::uint16_t width_px, std::uint16_t height_px, std::uint32_t refresh_hz,
                     std::uint32_t type) {
  drmModeModeInfo made{};
  made.hdisplay = width_px;
  made.vdisplay = height_px;
  made.vrefresh = refresh_hz;
  made.type = type;
  return made;
}

TEST(ChooseMode, TakesThePreferredModeOtherwiseTheLargestAndFastest) {
  std::vector modes{mode(1280, 720, 60, DRM_MODE_TYPE_DRIVER), mode(1920, 1080, 30, DRM_MODE_TYPE_DRIVER),
                    mode(1920, 1080, 60, DRM_MODE_TYPE_DRIVER), mode(640, 480, 75, DRM_MODE_TYPE_DRIVER)};
  EXPECT_EQ(&choose_mode(modes), &modes[2]);
  modes[0].type |= DRM_MODE_TYPE_PREFERRED;
  EXPECT_EQ(&choose_mode(modes), &modes[0]);
}

TEST(FindScreen, NamesEveryCardAndWhatIsWrongWithIt) {
  const test::TemporaryFolder folder;
  const auto none = find_screen("", folder.path().string());
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, rt::ExitCode::device_unavailable);
  EXPECT_NE(none.error().message.find("no graphics card"), std::string::npos) << none.error().message;

  folder.write("card1", "no card");
  folder.write("card0", "no card either");
  folder.write("renderD128", "not looked at");
  const auto wrong = find_screen("", folder.path().string());
  ASSERT_FALSE(wrong);
  const std::string& message = wrong.error().message;
  EXPECT_LT(message.find("card0: drives no screens"), message.find("card1: drives no screens")) << message;
  EXPECT_NE(message.find("card1: drives no screens"), std::string::npos) << message;
  EXPECT_EQ(message.find("renderD128"), std::string::npos);

  const auto absent = find_screen((folder.path() / "card7").string());
  ASSERT_FALSE(absent);
  EXPECT_NE(absent.error().message.find("card7: No such file"), std::string::npos) << absent.error().message;
}

TEST(KmsDisplay, WithoutAScreenCreateSaysWhy) {
  const auto created = KmsDisplay::create({640, 480}, {.device = "/dev/null"});
  ASSERT_FALSE(created);
  EXPECT_EQ(created.error().code, rt::ExitCode::device_unavailable);
  EXPECT_NE(created.error().message.find("/dev/null: drives no screens"), std::string::npos)
      << created.error().message;
}

}  // namespace
}  // namespace tactus::hal::egl
