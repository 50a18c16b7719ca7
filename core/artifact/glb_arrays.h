#pragma once
// Arrays of plain elements in buffer views of a glTF, on their way in (links_glb.h, points_glb.h).

#include <bit>
#include <cstring>
#include <vector>

#include "core/artifact/findings.h"
#include "core/artifact/gltf_bytes.h"
#include "core/artifact/json_fields.h"

namespace kiln {

static_assert(std::endian::native == std::endian::little, "the arrays of the file are little endian");

/// `fields` names a buffer view for each array; what is not named has no elements.
class ArrayViews {
 public:
  ArrayViews(const Fields& fields, const gltf::BufferBytes& bytes, Findings& findings)
      : fields_(fields), bytes_(bytes), findings_(findings) {}

  /// Fails with index_out_of_range and slot_count_mismatch.
  template <class T>
  std::vector<T> take(const char* name) const {
    if (!fields_.has(name)) return {};
    const int index = fields_.index(name, bytes_.views.size());
    if (findings_.failed()) return {};
    const auto view = bytes_.views[static_cast<std::size_t>(index)];
    if (view.size() % sizeof(T) != 0) {
      findings_.fail("slot_count_mismatch", "The buffer view does not hold whole elements.", fields_.pointer(name));
      return {};
    }
    std::vector<T> out(view.size() / sizeof(T));
    if (!out.empty()) std::memcpy(out.data(), view.data(), view.size());
    return out;
  }

 private:
  const Fields& fields_;
  const gltf::BufferBytes& bytes_;
  Findings& findings_;
};

}  // namespace kiln
