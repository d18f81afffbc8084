#include "client/load/nal_units.hpp"

#include <cstddef>

namespace darm::client::load {
namespace {

using namespace std::string_view_literals;

constexpr unsigned kSlice = 1, kIdrSlice = 5, kSei = 6, kSequence = 7, kPicture = 8, kDelimiter = 9;

// Type of the unit whose header byte is there; nothing in its place is 0, which no unit has.
unsigned type_at(std::string_view bytes, std::size_t at) {
  return at < bytes.size() && (static_cast<unsigned char>(bytes[at]) & 0x80u) == 0
             ? static_cast<unsigned char>(bytes[at]) & 0x1fu
             : 0;
}

}  // namespace

PictureStart picture_start(std::string_view annex_b) {
  constexpr auto kCode = "\0\0\1"sv;
  // A frame begins with a start code, not somewhere behind other bytes.
  std::size_t code = annex_b.find(kCode);
  if (code > 1 || (code == 1 && annex_b[0] != '\0')) return PictureStart::kOther;
  bool sequence = false, picture = false;
  while (code != std::string_view::npos) {
    switch (type_at(annex_b, code + kCode.size())) {
      case kSequence:
        sequence = true;
        break;
      case kPicture:
        picture = true;
        break;
      case kSei:
      case kDelimiter:
        break;
      case kIdrSlice:
        return sequence && picture ? PictureStart::kKey : PictureStart::kOther;
      case kSlice:
        return sequence || picture ? PictureStart::kOther : PictureStart::kDelta;
      default:
        return PictureStart::kOther;
    }
    code = annex_b.find(kCode, code + kCode.size());
  }
  return PictureStart::kOther;
}

}  // namespace darm::client::load
