#include "server/work/maker.h"

#include "core/bake/bake.h"

namespace kiln {

std::string maker_word() {
#if defined(__x86_64__)
  const char* kind = __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq") ? "avx512"
                     : __builtin_cpu_supports("avx2")                                         ? "avx2"
                     : __builtin_cpu_supports("avx")                                          ? "avx"
                                                                                              : "sse";
#else
  const char* kind = "other";
#endif
  return std::string(kEngineVersion) + " " + kind;
}

}  // namespace kiln
