#!/bin/sh
# lamps_picture.sh BUILD OUT.png: a metal ball of roughness .25 under three lamps, baked, and path traced beside it
# (core/lightfield/README.md). BUILD has bin/kiln and tests/bench/kiln_field_eyes.
set -e
here=$(dirname "$0")
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
node "$here/../browser/make_field.mjs" "$folder/ball.glb" lamps smooth
echo '{"steps": [{"do": "lightfield", "degree": 6, "rays": 512}], "quality": "draft"}' > "$folder/recipe.json"
"$1/bin/kiln" bake "$folder/ball.glb" -r "$folder/recipe.json" --local -o "$folder/out"
"$1/tests/bench/kiln_field_eyes" "$folder/ball.glb" "$2" "$folder/out/scene.glb" --eyes 1 --pixels 280 --samples 64
