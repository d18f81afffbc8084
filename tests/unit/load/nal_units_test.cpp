#include "client/load/nal_units.hpp"

#include <gtest/gtest.h>

#include "tests/unit/load/made_up_server.hpp"

namespace darm::client::load {
namespace {

using made_up::unit;

TEST(NalUnits, KeyFramesAndDeltasAreToldApart) {
  EXPECT_EQ(picture_start(made_up::key_picture()), PictureStart::kKey);
  EXPECT_EQ(picture_start(made_up::delta_picture()), PictureStart::kDelta);
  EXPECT_EQ(picture_start(unit(0x09) + unit(0x67) + unit(0x68) + unit(0x65)), PictureStart::kKey)
      << "a delimiter first";
  EXPECT_EQ(picture_start(unit(0x06) + unit(0x01)), PictureStart::kDelta) << "supplemental information first";
}

TEST(NalUnits, AKeyFrameNeedsBothParametersAndAnIdrSlice) {
  EXPECT_EQ(picture_start(unit(0x65)), PictureStart::kOther);
  EXPECT_EQ(picture_start(unit(0x67) + unit(0x65)), PictureStart::kOther);
  EXPECT_EQ(picture_start(unit(0x67) + unit(0x68)), PictureStart::kOther);
  EXPECT_EQ(picture_start(unit(0x67) + unit(0x68) + unit(0x41)), PictureStart::kOther);
}

TEST(NalUnits, WhatIsNoAccessUnitIsNothing) {
  EXPECT_EQ(picture_start(""), PictureStart::kOther);
  EXPECT_EQ(picture_start("abc"), PictureStart::kOther);
  EXPECT_EQ(picture_start(std::string("\0\0\1", 3)), PictureStart::kOther) << "a start code without a unit";
  EXPECT_EQ(picture_start(made_up::delta_picture().insert(0, 1, 'x')), PictureStart::kOther)
      << "bytes before the first unit";
  EXPECT_EQ(picture_start(unit(static_cast<char>(0xc1))), PictureStart::kOther) << "the forbidden bit";
}

}  // namespace
}  // namespace darm::client::load
