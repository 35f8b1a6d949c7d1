#include "datasets/npy.h"

#include "support/example_campaign.h"
#include "support/message_of.h"
#include "support/temporary_folder.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::HasSubstr;

class NpyTypes : public testing::TestWithParam<SampleType> {};

TEST_P(NpyTypes, WritesWhatItReads) {
  const test::TemporaryFolder folder;
  const RawFormat format{GetParam(), 4};
  const auto data = test::example_frames(100, 1, format);
  test::write_npy(folder / "a.npy", format, 100, data);
  const NpyFile file(folder / "a.npy");
  EXPECT_EQ(file.format(), format);
  EXPECT_EQ(file.frames(), 100u);
  EXPECT_EQ(std::vector<std::byte>(file.data().begin(), file.data().end()), data);
  EXPECT_EQ((format_npy_header(format, 100).size()) % 64, 0u);
}

INSTANTIATE_TEST_SUITE_P(All, NpyTypes,
                         testing::Values(SampleType::kInt16, SampleType::kUInt16, SampleType::kFloat32,
                                         SampleType::kFloat64),
                         [](const auto& type) { return std::string(name_of(type.param)); });

std::string header(const std::string& dict) {
  std::string bytes("\x93NUMPY\x01\0", 8);
  bytes.push_back(static_cast<char>(dict.size()));
  bytes.push_back('\0');
  return bytes + dict;
}

std::string refusal(const std::string& bytes) {
  return message_of([&] { parse_npy_header(std::as_bytes(std::span(bytes)), "a.npy"); });
}

TEST(Npy, NamesWhatItRefuses) {
  EXPECT_THAT(refusal("PK"), HasSubstr("a.npy: is not a .npy file"));
  EXPECT_THAT(refusal(std::string("\x93NUMPY\x02\0\0\0", 10)), HasSubstr("version 2.0"));
  EXPECT_THAT(refusal(header("{'descr': '<i2', 'fortran_order': True, 'shape': (3, 4), }")),
              HasSubstr("Fortran order"));
  EXPECT_THAT(refusal(header("{'descr': '>i2', 'fortran_order': False, 'shape': (3, 4), }")),
              HasSubstr("'>i2'"));
  EXPECT_THAT(refusal(header("{'descr': '<i8', 'fortran_order': False, 'shape': (3, 4), }")),
              HasSubstr("'<i8'"));
  EXPECT_THAT(refusal(header("{'descr': '<i2', 'fortran_order': False, 'shape': (12,), }")),
              HasSubstr("has shape (12)"));
  EXPECT_THAT(refusal(header("{'descr': '<i2', 'fortran_order': False, 'shape': (3, 7), }")),
              HasSubstr("(frames, 4) is required"));
  EXPECT_THAT(refusal(header("{'descr': '<i2', 'shape': (3, 4), }")), HasSubstr("no 'fortran_order'"));
}

TEST(Npy, RefusesAFileOfAnotherLengthThanItsShape) {
  const test::TemporaryFolder folder;
  test::write_npy(folder / "a.npy", {}, 10, test::example_frames(9, 1));
  EXPECT_THAT(message_of([&] { NpyFile file(folder / "a.npy"); }),
              HasSubstr("holds 72 bytes of samples where its shape (10, 4) needs 80"));
  EXPECT_THAT(message_of([&] { NpyFile file(folder / "none.npy"); }), HasSubstr("cannot be read"));
}

}  // namespace
}  // namespace tunnelrig
