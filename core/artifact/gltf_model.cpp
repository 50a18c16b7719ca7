#include "core/artifact/gltf_model.h"

#include <tiny_gltf.h>

namespace kiln::gltf {

using tinygltf::Value;

const Value* find_extension(const Extensions& extensions, const char* name) {
  const auto at = extensions.find(name);
  return at == extensions.end() ? nullptr : &at->second;
}

const Value* find_member(const Value& object, const char* name) {
  return object.Has(name) ? &object.Get(name) : nullptr;
}

double number_of(const Value& object, const char* name, double absent) {
  const Value* value = find_member(object, name);
  return value && value->IsNumber() ? value->GetNumberAsDouble() : absent;
}

int index_of(const Value& object, const char* name) { return static_cast<int>(number_of(object, name, -1)); }

std::string text_of(const Value& object, const char* name) {
  const Value* value = find_member(object, name);
  return value && value->IsString() ? value->Get<std::string>() : "";
}

std::map<std::string, int> index_map_of(const Value& object, const char* name) {
  std::map<std::string, int> out;
  const Value* map = find_member(object, name);  // tinygltf leaves out empty ones
  if (!map || !map->IsObject()) return out;
  for (const auto& [key, value] : map->Get<Value::Object>()) out[key] = value.GetNumberAsInt();
  return out;
}

}  // namespace kiln::gltf
