#!/usr/bin/env bash
# The studio under real mouse events: two strokes are drawn, one is split, a still is rendered. The still must be what
# `bansho render` makes of the saved file, byte for byte, and then the window must rest.
#   crates/studio/tests/native.sh [STUDIO] [BANSHO] [PAINTER]
# It needs Xvfb and xdotool, and for the painter `gpu` a Vulkan driver (Mesa's lavapipe will do).
set -eu
studio="$(realpath "${1:-target/debug/bansho-studio}")"
bansho="$(realpath "${2:-target/debug/bansho}")"
painter="${3:-auto}"
folder="$(mktemp -d)"
export XDG_DATA_HOME="$folder/home" XDG_RUNTIME_DIR="$folder"

# Without -noreset the server starts anew whenever its last client leaves, and refuses who comes meanwhile.
Xvfb -displayfd 3 -noreset -screen 0 1400x900x24 3>"$folder/display" >"$folder/xvfb.log" 2>&1 &
xvfb=$!
trap 'kill "$xvfb" "${window:-$xvfb}" 2>/dev/null || true' EXIT

cat >"$folder/sky.toml" <<'SCENE'
# An empty sky.
bansho = 2
[picture]
size = [320, 180]
frames = 2
[camera]
position = [0.0, 1.7, 0.0]
target = [0.0, 30.0, -60.0]
vertical_fov_deg = 62.0
[[aurora]]
preroll_s = 0.0
particles = { count = 800 } # few, to be quick
field = { cells = 63 }
SCENE

fail() {
  echo "FAILED: $1" >&2
  for log in xvfb studio; do
    [ ! -e "$folder/$log.log" ] || cat "$folder/$log.log" >&2
  done
  cat "$folder/sky.toml" >&2
  import -window root "$folder/failed.png" 2>/dev/null && echo "see $folder/failed.png" >&2
  exit 1
}

# within SECONDS WHAT COMMAND...: repeats the command until it succeeds.
within() {
  local end=$((SECONDS + $1)) what="$2"
  shift 2
  while ! "$@" >/dev/null 2>&1; do
    [ "$SECONDS" -lt "$end" ] || fail "$what"
    sleep 0.5
  done
}

# What the window takes for a picture at most, s: hands that are faster click where nothing is yet.
pace="${STUDIO_PACE:-0.5}"

click() { xdotool mousemove "$1" "$2" sleep "$pace" mousedown 1 sleep 0.1 mouseup 1 sleep "$pace"; }

# stroke X Y X Y...: by small steps, as a hand goes.
stroke() {
  xdotool mousemove "$1" "$2" sleep "$pace" mousedown 1 sleep "$pace"
  while [ "$#" -ge 4 ]; do
    for step in 1 2 3 4 5 6 7 8; do
      xdotool mousemove "$(($1 + ($3 - $1) * step / 8))" "$(($2 + ($4 - $2) * step / 8))" sleep 0.05
    done
    shift 2
  done
  xdotool sleep "$pace" mouseup 1 sleep "$pace"
}

# saved PATTERN: saves, and looks for the pattern in the file.
saved() { xdotool key ctrl+s sleep 1 && grep -q "$1" sky.toml; }

shapes_are_two() { xdotool key ctrl+s sleep 1 && [ "$(grep -c 'aurora.shapes' sky.toml)" = 2 ]; }

within 60 "no X server" test -s "$folder/display"
DISPLAY=":$(cat "$folder/display")"
export DISPLAY
cd "$folder"
"$studio" --painter "$painter" sky.toml >"$folder/studio.log" 2>&1 &
window=$!
within 120 "no window" xdotool search --onlyvisible --name "Bansho Studio"
sleep "${STUDIO_WAIT:-8}"
# No window manager gives the window the keys.
within 20 "no focus" xdotool search --onlyvisible --name "Bansho Studio" windowfocus

# Each is repeated where a window that is busy missed it; what was done already is refused the second time.
first_stroke() { stroke 640 490 760 460 890 490; saved 'sheets = .*points = '; }
second_stroke() { stroke 640 580 760 550 890 580; saved 'points = .*points = '; }
split() {
  click 464 378 # Split
  click 388 464 # the middle of the first sheet, on the left
  saved 'split = .{ sheet = 1'
}

within 90 "the first stroke is not in the file" first_stroke
within 90 "the second stroke is not in the file" second_stroke
click 246 402 # Add shape
within 60 "no second shape" shapes_are_two
within 90 "no split" split

xdotool key F12
within 300 "no still" sh -c 'find . -name "*.png" | grep -q .'
sleep 1
still="$(find "$folder" -name '*.png' | head -1)"
number="$(basename "$still" .png | grep -oE '[0-9]+$' | sed 's/^0*\(.\)/\1/')"
"$bansho" render sky.toml --frames "$number" --out "$folder/again/s.####.png" >"$folder/render.log" 2>&1 || fail "$(cat "$folder/render.log")"
again="$(find "$folder/again" -name '*.png' | head -1)"
cmp "$still" "$again" || fail "the still is not what is rendered"
# The window rests when nothing moves.
spent_s() { awk -v hertz="$(getconf CLK_TCK)" '{ print ($14 + $15) / hertz }' "/proc/$window/stat"; }
sleep 3
before="$(spent_s)"
sleep 10
idle="$(awk -v before="$before" -v after="$(spent_s)" 'BEGIN { printf "%.1f", 10 * (after - before) }')"
awk -v idle="$idle" 'BEGIN { exit !(idle < 2) }' || fail "an idle window takes $idle % of a core"
echo "an idle window ($painter) takes $idle % of a core"
echo "the still of frame $number is what bansho render makes of the saved file, byte for byte"
