#include "core/artifact/gltf_schema.h"

#include <tiny_gltf.h>

namespace kiln::gltf {
namespace {

constexpr Member plain(std::string_view name, Is is) { return {.name = name, .is = is}; }
constexpr Member index(std::string_view name, std::string_view of) { return {.name = name, .is = Is::index, .of = of}; }
constexpr Member indices(std::string_view name, std::string_view of) {
  return {.name = name, .is = Is::indices, .of = of};
}
constexpr Member index_map(std::string_view name, std::string_view of) {
  return {.name = name, .is = Is::index_map, .of = of};
}
constexpr Member word(std::string_view name, std::span<const std::string_view> words) {
  return {.name = name, .is = Is::word, .words = words};
}
constexpr Member code(std::string_view name, std::span<const int> codes) {
  return {.name = name, .is = Is::code, .codes = codes};
}
constexpr Member numbers(std::string_view name, std::size_t count) {
  return {.name = name, .is = Is::numbers, .count = count};
}
constexpr Member reals(std::string_view name, std::size_t count) {
  return {.name = name, .is = Is::reals, .count = count};
}
constexpr Member object(std::string_view name, const Kind& kind) {
  return {.name = name, .is = Is::object, .kind = &kind};
}
constexpr Member objects(std::string_view name, const Kind& kind) {
  return {.name = name, .is = Is::objects, .kind = &kind};
}
constexpr Member required(Member member) {
  member.required = true;
  return member;
}

/// An extension's members become values in maps, and tinygltf keeps those of materials twice.
constexpr std::size_t values(std::size_t count) { return (count + 1) * kNamedValueBytes; }

/// One in a vector that has doubled, with its short strings and arrays.
template <class T>
constexpr std::size_t kHeld = 2 * sizeof(T) + 128;

constexpr int kComponents[] = {5120, 5121, 5122, 5123, 5125, 5126}, kModes[] = {0, 1, 2, 3, 4, 5, 6},
              kWraps[] = {10497, 33071, 33648};
constexpr std::string_view kTypes[] = {"SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"},
                           kAlphaModes[] = {"OPAQUE", "MASK", "BLEND"},
                           kLightTypes[] = {"point", "spot", "directional"},
                           kMeshoptModes[] = {"ATTRIBUTES", "TRIANGLES", "INDICES"},
                           kMeshoptFilters[] = {"NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL"},
                           kRadianceBases[] = {"sh", "polynomial"};

// Buffers, views, accessors.

constexpr Member kFallbackMembers[] = {plain("fallback", Is::flag)};
constexpr Kind kFallback{kFallbackMembers};
constexpr Member kBufferExtensionMembers[] = {object("EXT_meshopt_compression", kFallback)};
constexpr Kind kBufferExtensions{kBufferExtensionMembers};
constexpr Member kBufferMembers[] = {required(plain("byteLength", Is::whole)), plain("uri", Is::text),
                                     object("extensions", kBufferExtensions)};
constexpr Kind kBuffer{kBufferMembers};

constexpr Member kMeshoptMembers[] = {required(index("buffer", "buffers")),
                                      plain("byteOffset", Is::value_whole),
                                      required(plain("byteLength", Is::value_whole)),
                                      required(plain("byteStride", Is::value_whole)),
                                      required(plain("count", Is::value_whole)),
                                      required(word("mode", kMeshoptModes)),
                                      word("filter", kMeshoptFilters)};
constexpr Kind kMeshopt{kMeshoptMembers, values(7)};
constexpr Member kViewExtensionMembers[] = {object("EXT_meshopt_compression", kMeshopt)};
constexpr Kind kViewExtensions{kViewExtensionMembers};
constexpr Member kViewMembers[] = {required(index("buffer", "buffers")), plain("byteOffset", Is::whole),
                                   required(plain("byteLength", Is::whole)), plain("byteStride", Is::whole),
                                   object("extensions", kViewExtensions)};
constexpr Kind kView{kViewMembers, kHeld<tinygltf::BufferView>};

constexpr Member kSparseIndicesMembers[] = {required(index("bufferView", "bufferViews")),
                                            plain("byteOffset", Is::small_whole),
                                            required(code("componentType", kComponents))};
constexpr Kind kSparseIndices{kSparseIndicesMembers};
constexpr Member kSparseValuesMembers[] = {required(index("bufferView", "bufferViews")),
                                           plain("byteOffset", Is::small_whole)};
constexpr Kind kSparseValues{kSparseValuesMembers};
constexpr Member kSparseMembers[] = {required(plain("count", Is::small_whole)),
                                     required(object("indices", kSparseIndices)),
                                     required(object("values", kSparseValues))};
constexpr Kind kSparse{kSparseMembers};
constexpr Member kAccessorMembers[] = {index("bufferView", "bufferViews"),
                                       plain("byteOffset", Is::whole),
                                       required(plain("count", Is::whole)),
                                       required(code("componentType", kComponents)),
                                       plain("normalized", Is::flag),
                                       required(word("type", kTypes)),
                                       object("sparse", kSparse),
                                       plain("min", Is::bounds),
                                       plain("max", Is::bounds)};
constexpr Kind kAccessor{kAccessorMembers, kHeld<tinygltf::Accessor>};

// Meshes, nodes, scenes.

constexpr Member kDracoMembers[] = {required(index("bufferView", "bufferViews")), index_map("attributes", "")};
constexpr Kind kDraco{kDracoMembers, values(2)};
constexpr Member kPrimitiveExtensionMembers[] = {object("KHR_draco_mesh_compression", kDraco)};
constexpr Kind kPrimitiveExtensions{kPrimitiveExtensionMembers};
constexpr Member kTargetMembers[] = {index("POSITION", "accessors")};
constexpr Kind kTarget{kTargetMembers, kHeld<std::map<std::string, int>>};
constexpr Member kPrimitiveMembers[] = {required(index_map("attributes", "accessors")),
                                        index("indices", "accessors"),
                                        index("material", "materials"),
                                        code("mode", kModes),
                                        objects("targets", kTarget),
                                        object("extensions", kPrimitiveExtensions)};
constexpr Kind kPrimitive{kPrimitiveMembers, kHeld<tinygltf::Primitive>};
constexpr Member kMeshMembers[] = {plain("name", Is::text), required(objects("primitives", kPrimitive))};
constexpr Kind kMesh{kMeshMembers, kHeld<tinygltf::Mesh>};

constexpr Member kNodeLightMembers[] = {index("light", "lights")};
constexpr Kind kNodeLight{kNodeLightMembers, values(1)};
constexpr Member kInstancingMembers[] = {index_map("attributes", "accessors")};
constexpr Kind kInstancing{kInstancingMembers, values(1)};
constexpr Member kNodeExtensionMembers[] = {object("KHR_lights_punctual", kNodeLight),
                                            object("EXT_mesh_gpu_instancing", kInstancing)};
constexpr Kind kNodeExtensions{kNodeExtensionMembers};
constexpr Member kNodeMembers[] = {
    plain("name", Is::text), indices("children", "nodes"), index("mesh", "meshes"),
    index("skin", "skins"),  numbers("matrix", 16),        numbers("translation", 3),
    numbers("rotation", 4),  numbers("scale", 3),          object("extensions", kNodeExtensions)};
constexpr Kind kNode{kNodeMembers, kHeld<tinygltf::Node>};
constexpr Member kSceneMembers[] = {indices("nodes", "nodes")};
constexpr Kind kScene{kSceneMembers, kHeld<tinygltf::Scene>};

// Images, textures, materials, lights.

constexpr Member kImageMembers[] = {plain("name", Is::text), plain("uri", Is::text), plain("mimeType", Is::text),
                                    index("bufferView", "bufferViews")};
constexpr Kind kImage{kImageMembers};
constexpr Member kSamplerMembers[] = {code("wrapS", kWraps), code("wrapT", kWraps),
                                      plain("magFilter", Is::small_whole)};
constexpr Kind kSampler{kSamplerMembers, kHeld<tinygltf::Sampler>};
constexpr Member kOtherSourceMembers[] = {index("source", "images")};
constexpr Kind kOtherSource{kOtherSourceMembers, values(1)};
constexpr Member kTextureExtensionMembers[] = {
    object("KHR_texture_basisu", kOtherSource), object("EXT_texture_webp", kOtherSource),
    object("EXT_texture_avif", kOtherSource), object("MSFT_texture_dds", kOtherSource)};
constexpr Kind kTextureExtensions{kTextureExtensionMembers};
constexpr Member kTextureMembers[] = {index("sampler", "samplers"), index("source", "images"),
                                      object("extensions", kTextureExtensions)};
constexpr Kind kTexture{kTextureMembers, kHeld<tinygltf::Texture>};

constexpr Member kTransformMembers[] = {reals("offset", 2), reals("scale", 2), plain("rotation", Is::real),
                                        plain("texCoord", Is::small_whole)};
constexpr Kind kTransform{kTransformMembers, values(8)};
constexpr Member kTextureInfoExtensionMembers[] = {object("KHR_texture_transform", kTransform)};
constexpr Kind kTextureInfoExtensions{kTextureInfoExtensionMembers, values(1)};
constexpr Member kTextureInfoMembers[] = {index("index", "textures"), plain("texCoord", Is::small_whole),
                                          plain("scale", Is::real), object("extensions", kTextureInfoExtensions)};
constexpr Kind kTextureInfo{kTextureInfoMembers, values(4)};
constexpr Member kMetallicRoughnessMembers[] = {reals("baseColorFactor", 4), object("baseColorTexture", kTextureInfo),
                                                plain("metallicFactor", Is::real), plain("roughnessFactor", Is::real),
                                                object("metallicRoughnessTexture", kTextureInfo)};
constexpr Kind kMetallicRoughness{kMetallicRoughnessMembers, values(5)};
constexpr Member kSpecularGlossinessMembers[] = {reals("diffuseFactor", 4), object("diffuseTexture", kTextureInfo),
                                                 plain("glossinessFactor", Is::real)};
constexpr Kind kSpecularGlossiness{kSpecularGlossinessMembers, values(7)};
constexpr Member kEmissiveStrengthMembers[] = {plain("emissiveStrength", Is::real)};
constexpr Kind kEmissiveStrength{kEmissiveStrengthMembers, values(1)};
constexpr Kind kUnlit{{}, values(0)};
constexpr Member kMaterialExtensionMembers[] = {object("KHR_materials_pbrSpecularGlossiness", kSpecularGlossiness),
                                                object("KHR_materials_emissive_strength", kEmissiveStrength),
                                                object("KHR_materials_unlit", kUnlit)};
constexpr Kind kMaterialExtensions{kMaterialExtensionMembers};
constexpr Member kMaterialMembers[] = {plain("name", Is::text),
                                       object("pbrMetallicRoughness", kMetallicRoughness),
                                       reals("emissiveFactor", 3),
                                       object("emissiveTexture", kTextureInfo),
                                       object("normalTexture", kTextureInfo),
                                       word("alphaMode", kAlphaModes),
                                       plain("alphaCutoff", Is::real),
                                       plain("doubleSided", Is::flag),
                                       object("extensions", kMaterialExtensions)};
constexpr Kind kMaterial{kMaterialMembers, kHeld<tinygltf::Material> + values(8)};

constexpr Member kSpotMembers[] = {plain("innerConeAngle", Is::real), plain("outerConeAngle", Is::real)};
constexpr Kind kSpot{kSpotMembers};
constexpr Member kLightMembers[] = {plain("name", Is::text),  required(word("type", kLightTypes)),
                                    reals("color", 3),        plain("intensity", Is::real),
                                    plain("range", Is::real), object("spot", kSpot)};
constexpr Kind kLight{kLightMembers, kHeld<tinygltf::Light> + 3 * values(8)};
constexpr Member kLightsMembers[] = {objects("lights", kLight)};
constexpr Kind kLights{kLightsMembers};
constexpr Member kRadianceMembers[] = {
    required(plain("version", Is::small_whole)), required(word("basis", kRadianceBases)),
    required(plain("degree", Is::small_whole)), required(plain("reflected", Is::flag))};
constexpr Kind kRadiance{kRadianceMembers};
constexpr Member kRootExtensionMembers[] = {object("KHR_lights_punctual", kLights),
                                            object("KILN_radiance_functions", kRadiance)};
constexpr Kind kRootExtensions{kRootExtensionMembers};

constexpr Member kAssetMembers[] = {required(plain("version", Is::text))};
constexpr Kind kAsset{kAssetMembers};

/// Arrays that others refer to come first: where one is no array, that is the fault to tell.
constexpr Member kRootMembers[] = {
    required(object("asset", kAsset)),
    plain("extensionsUsed", Is::texts),
    plain("extensionsRequired", Is::texts),
    objects("buffers", kBuffer),
    objects("bufferViews", kView),
    objects("accessors", kAccessor),
    objects("images", kImage),
    objects("samplers", kSampler),
    objects("textures", kTexture),
    objects("materials", kMaterial),
    objects("meshes", kMesh),
    plain("skins", Is::list),
    object("extensions", kRootExtensions),
    objects("nodes", kNode),
    objects("scenes", kScene),
    index("scene", "scenes"),
};
constexpr Kind kRoot{kRootMembers};

}  // namespace

const Kind& document_kind() { return kRoot; }

}  // namespace kiln::gltf
