#!/usr/bin/env bash
# Everything hostile under ASan and UBSan: first what we know by name (hostile_inputs: broken files with their answers, the
# list of known attacks, mutations), then fuzz targets for so many seconds each, as many at a time as there are cores.
#   tests/fuzz/run.sh SECONDS [NAME ...]        fails when an input crashes, hangs for 10 s or takes more than 2 GB
# What the targets find new stays in .kiln/fuzz/NAME. An input that broke one lies in .kiln/fuzz/crashes/NAME-...:
# build/fuzz/tests/fuzz/fuzz_NAME FILE runs it again.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
state="$root/.kiln/fuzz"
programs="$root/build/fuzz/tests/fuzz"
seconds=${1:?usage: run.sh SECONDS [NAME ...]}
shift
[ $# -gt 0 ] || set -- scene artefact ply head recipe s3_list # the longest first

build() {
  command -v clang++ >/dev/null || { echo "run.sh wants the Debian packages clang and libclang-rt-dev" >&2; exit 1; }
  local launcher=()
  command -v ccache >/dev/null && launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache -DCMAKE_C_COMPILER_LAUNCHER=ccache)
  (cd "$root" && cmake --preset fuzz "${launcher[@]}" && cmake --build --preset fuzz) >"$state/build.log" 2>&1 ||
    { grep -E 'error|FAILED' "$state/build.log" >&2 || tail -n 20 "$state/build.log" >&2; exit 1; }
}

seeds_of() { # the folders that CMakeLists.txt names, as far as they are here
  local models="$root/../shared/models" folder
  for folder in "$here/seeds/$1" "$root/tests/browser/fixtures" "$models/hostile" "$models/conformance" "$state/packed"; do
    case "$1:$folder" in
      scene:* | artefact:*/fixtures | ply:*/hostile | *:*/seeds/*) [ ! -d "$folder" ] || echo "$folder" ;;
    esac
  done
}

fuzz() { # fuzz NAME: a line of figures; fails when the target does
  local name=$1 sound=0 seeds options runs edges peak
  mkdir -p "$state/$name"
  mapfile -t seeds < <(seeds_of "$name")
  options=(-max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -max_len=524288 -print_final_stats=1)
  case "$name" in scene | artefact) options+=(-dict="$here/gltf.dict") ;; esac
  "$programs/fuzz_$name" "${options[@]}" -artifact_prefix="$state/crashes/$name-" "$state/$name" "${seeds[@]}" \
    >"$state/$name.log" 2>&1 || sound=1
  runs=$(sed -nE 's/stat::number_of_executed_units: +//p' "$state/$name.log")
  edges=$(sed -nE 's/.* cov: ([0-9]+) .*/\1/p' "$state/$name.log" | tail -n 1)
  peak=$(sed -nE 's/stat::peak_rss_mb: +//p' "$state/$name.log")
  printf '%-9s %9s inputs, %5s edges, %4s MB\n' "$name" "${runs:-?}" "${edges:-?}" "${peak:-?}"
  [ "$sound" = 0 ] || echo "broken: $name (see .kiln/fuzz/$name.log)" >&2
  return "$sound"
}

mkdir -p "$state/crashes"
build
# Seeds in one piece, so that mutations reach the binary part of a glTF.
if [ -d "$root/../shared/models" ] && command -v python3 >/dev/null; then
  python3 "$here/pack.py" "$root/../shared/models" "$state/packed"
fi

# What a library asks for in vain it is told so (std::bad_alloc), as under the limits of a worker. What was freed is
# watched in 16 MB and not in 256, since memory has limits here.
export ASAN_OPTIONS=allocator_may_return_null=1:detect_leaks=1:quarantine_size_mb=16 UBSAN_OPTIONS=print_stacktrace=1
"$programs/hostile_inputs" --gtest_brief=1 >"$state/hostile_inputs.log" 2>&1 ||
  { cat "$state/hostile_inputs.log" >&2; exit 1; }
grep -E '^\[==========\]' "$state/hostile_inputs.log" || tail -n 3 "$state/hostile_inputs.log"

export -f fuzz seeds_of
export here root state programs seconds
printf '%s\0' "$@" | xargs -0 -n 1 -P "$(nproc)" bash -c 'fuzz "$0"'
