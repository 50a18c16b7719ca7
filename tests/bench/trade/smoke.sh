#!/usr/bin/env bash
# A smoke sweep writes everything it should; run again it repeats nothing; cut off in a row it repeats that row alone.
#   smoke.sh KILN_TRADE
set -euo pipefail
tool=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
fail() { echo "smoke: $1"; exit 1; }
sweep() { "$tool" --out "$folder/out" --smoke >"$folder/said"; }

sweep
grep -q '^runs: 4 new, 0 known, 0 left$' "$folder/said" || fail "the first sweep did not make its four runs"
grep -q '^  column ' "$folder/said" || fail "no predicted / measured line for the scene"
for file in trade.csv time.svg bytes.svg presets.json; do [ -s "$folder/out/$file" ] || fail "no $file"; done
[ "$(wc -l <"$folder/out/trade.csv")" = 5 ] || fail "trade.csv is not a head and four rows"
grep -q '"chosen"' "$folder/out/presets.json" || fail "presets.json chooses nothing"
cp "$folder/out/trade.csv" "$folder/first.csv"

sweep
grep -q '^runs: 0 new, 4 known, 0 left$' "$folder/said" || fail "runs were repeated"
cmp -s "$folder/first.csv" "$folder/out/trade.csv" || fail "rows changed without a run"

truncate -s -9 "$folder/out/trade.csv"
sweep
grep -q '^runs: 1 new, 3 known, 0 left$' "$folder/said" || fail "a row cut off was not made again, alone"
[ "$(wc -l <"$folder/out/trade.csv")" = 5 ] || fail "trade.csv is not whole again"
