#!/usr/bin/env bash
# Runs fuzz targets for so many seconds each, one after another; what they find new stays in .kiln/fuzz/NAME.
#   tests/fuzz/run.sh SECONDS [NAME ...]        fails when an input crashes, hangs for 10 s or takes more than 2 GB
# The input that did so lies in .kiln/fuzz/crashes/NAME-...: build/fuzz/tests/fuzz/fuzz_NAME FILE runs it again.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
seconds=${1:?usage: run.sh SECONDS [NAME ...]}
shift
[ $# -gt 0 ] || set -- head recipe s3_list ply scene artefact

command -v clang++ >/dev/null || { echo "run.sh wants the Debian packages clang and libclang-rt-dev" >&2; exit 1; }
launcher=()
command -v ccache >/dev/null && launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache -DCMAKE_C_COMPILER_LAUNCHER=ccache)
mkdir -p "$root/.kiln/fuzz/crashes"
(cd "$root" && cmake --preset fuzz "${launcher[@]}" && cmake --build --preset fuzz) >"$root/.kiln/fuzz/build.log" 2>&1 ||
  { grep -E 'error|FAILED' "$root/.kiln/fuzz/build.log" >&2 || tail -n 20 "$root/.kiln/fuzz/build.log" >&2; exit 1; }

seeds_of() { # the folders that CMakeLists.txt names, as far as they are here
  local models="$root/../shared/models" folder
  for folder in "$here/seeds/$1" "$root/tests/browser/fixtures" "$models/hostile" "$models/conformance" \
    "$root/.kiln/fuzz/packed"; do
    case "$1:$folder" in
      scene:* | artefact:*/fixtures | ply:*/hostile | *:*/seeds/*) [ ! -d "$folder" ] || echo "$folder" ;;
    esac
  done
}

# Seeds in one piece, so that mutations reach the binary part of a glTF.
if [ -d "$root/../shared/models" ] && command -v python3 >/dev/null; then
  python3 "$here/pack.py" "$root/../shared/models" "$root/.kiln/fuzz/packed"
fi

# What a library asks for in vain it is told so (std::bad_alloc), as under the limits of a worker.
export ASAN_OPTIONS=allocator_may_return_null=1:detect_leaks=1 UBSAN_OPTIONS=print_stacktrace=1
failed=()
for name in "$@"; do
  corpus="$root/.kiln/fuzz/$name"
  mkdir -p "$corpus"
  mapfile -t seeds < <(seeds_of "$name")
  options=(-max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -max_len=524288 -print_final_stats=1)
  case "$name" in scene | artefact) options+=(-dict="$here/gltf.dict") ;; esac
  log="$root/.kiln/fuzz/$name.log"
  "$root/build/fuzz/tests/fuzz/fuzz_$name" "${options[@]}" -artifact_prefix="$root/.kiln/fuzz/crashes/$name-" \
    "$corpus" "${seeds[@]}" >"$log" 2>&1 || failed+=("$name")
  runs=$(sed -nE 's/stat::number_of_executed_units: +//p' "$log")
  edges=$(sed -nE 's/.* cov: ([0-9]+) .*/\1/p' "$log" | tail -n 1)
  peak=$(sed -nE 's/stat::peak_rss_mb: +//p' "$log")
  printf '%-9s %9s inputs, %5s edges, %4s MB\n' "$name" "${runs:-?}" "${edges:-?}" "${peak:-?}"
done
[ ${#failed[@]} -eq 0 ] || { echo "broken: ${failed[*]} (see .kiln/fuzz/NAME.log)" >&2; exit 1; }
