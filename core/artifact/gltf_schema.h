#pragma once
// What objects of a glTF hold, as data. tinygltf turns a member of the wrong type into a default without a word and
// narrows numbers to int; check_tree (gltf_tree.h) walks this table before tinygltf sees anything.

#include <cstddef>
#include <span>
#include <string_view>

namespace kiln::gltf {

enum class Is {
  flag,
  text,
  word,         // one of `words`
  real,         // a number of at most 1e30 in size: a float holds it
  whole,        // 0 .. 2^53
  small_whole,  // 0 .. 2^31 - 1: tinygltf holds it as int
  value_whole,  // 0 .. 2^53, in an extension: to be written with a point, or tinygltf narrows it to int
  code,         // one of `codes`
  index,        // below the size of the root's array `of`
  indices,      // an array of such
  index_map,    // an object of such, under any name
  numbers,      // exactly `count`
  reals,
  bounds,  // numbers if there are three; others are not used
  texts,
  list,  // an array, whatever it holds
  object,
  objects,
};

struct Kind;

struct Member {
  std::string_view name;
  Is is = Is::flag;
  const Kind* kind = nullptr;  // of `object` and `objects`
  std::string_view of = {};    // of indices
  std::span<const std::string_view> words = {};
  std::span<const int> codes = {};
  std::size_t count = 0;  // of `numbers` and `reals`
  bool required = false;
};

/// Members that are not listed have no effect on a bake: they are neither checked nor handed to tinygltf.
struct Kind {
  std::span<const Member> members;
  std::size_t model_bytes = 0;  // an upper bound of what tinygltf's form of one takes
};

/// The root of a glTF.
const Kind& document_kind();

/// What tinygltf takes for a named value of an extension, or for an attribute.
inline constexpr std::size_t kNamedValueBytes = 256;

}  // namespace kiln::gltf
