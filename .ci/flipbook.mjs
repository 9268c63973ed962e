// A flipbook in three.js: the code of docs/src/guide/games.md draws sheets of a torch, and every pixel must be what the sheet's own
// codes and the blend mode make of it. Each alpha convention is drawn as that page says, and once as it must not be.
//   node .ci/flipbook.mjs BANSHO CHROMIUM OUT
// It needs playwright-core and three (npm install playwright-core three), found by NODE_PATH.
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync, rmSync, symlinkSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join, resolve } from "node:path";
import { inflateSync } from "node:zlib";
import { launch, serve } from "../crates/studio/web/browser.mjs";

const [bansho, executablePath, out] = process.argv.slice(2);
const GUIDE = "docs/src/guide/games.md";
// Frames in different rows and columns of the sheet, and a picture so wide that it is cropped to the flame.
const [GRID, SIZE, FRAMES] = ["4x4", "192x128", [2, 7, 12]];
// Codes of the backgrounds, and most codes by which a pixel may differ from what it must be.
const [BLACK, GRAY, ALLOWED] = [0, 128, 2];
// Both conventions show the same flame over black but for rounding of color, alpha and dither in both sheets.
const SAME_FLAME = 3;
// Fewest codes that the wrong convention must be wrong by, so that this test can tell them apart.
const WRONG = 10;
// How the guide draws a sheet: the alpha convention, which also names the values that are blended, and the blend modes that it gives.
const PIPELINES = [
  { name: "WebGLRenderer to the canvas", alpha: "encoded", page: "webgl", pipeline: "canvas", modes: ["cover", "add", "screen"] },
  { name: "EffectComposer, OutputPass", alpha: "linear", page: "webgl", pipeline: "composer", modes: ["cover", "add"] },
  { name: "WebGPURenderer", alpha: "linear", page: "webgpu", pipeline: "webgpu", modes: ["cover", "add"] },
];

// The blocks of JavaScript under the guide's heading `three.js`: the sprite with its blend modes, and how it is composed in linear light.
function guideBlocks() {
  const section = readFileSync(GUIDE, "utf8").split(/^## /m).find((part) => part.startsWith("three.js\n")) ?? "";
  const blocks = [...section.matchAll(/^```js\n(.*?)^```$/gms)].map(([, code]) => code);
  if (blocks.length !== 2) throw new Error(`${GUIDE} has ${blocks.length} blocks of JavaScript for three.js; expected: 2`);
  return blocks;
}

const html = (three, script) => `<!doctype html><meta charset="utf-8">
<script type="importmap">{ "imports": { "three": "/three/build/${three}", "three/addons/": "/three/examples/jsm/" } }</script>
<script type="module">${script}</script>`;

// A scene with nothing but a background and the sprite, seen so that a pixel of the picture is one of the canvas.
const COMMON = `
import * as THREE from "three";
import * as guide from "/flipbook.js";
async function sceneOf({ sheet, frame, background, mode }) {
  const info = await (await fetch(sheet)).json();
  const [width, height] = info.picture;
  const scene = new THREE.Scene();
  scene.background = new THREE.Color(\`rgb(\${background}, \${background}, \${background})\`);
  const { sprite, show } = await guide.loadFlipbook(sheet, guide[mode]);
  scene.add(sprite);
  // Half a frame later it is still this one; another turn later it is again.
  show((info.frame_count + frame + 0.5) / info.fps);
  const camera = new THREE.OrthographicCamera(-0.5 * width / height, 0.5 * width / height, 0.5, -0.5, 0.1, 10);
  camera.position.z = 1;
  return { scene, camera, width, height };
}
// To be called in the task that has drawn: a canvas is blank after it.
function pixelsOf(canvas) {
  const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d");
  copy.drawImage(canvas, 0, 0);
  return Array.from(copy.getImageData(0, 0, canvas.width, canvas.height).data);
}
`;
const WEBGL = `${COMMON}
import { linearComposer } from "/composer.js";
window.draw = async (asked) => {
  const { scene, camera, width, height } = await sceneOf(asked);
  const renderer = new THREE.WebGLRenderer();
  renderer.setSize(width, height);
  // Straight to the canvas each material is tone mapped by itself, and the sprite must be left out of it.
  if (asked.pipeline === "canvas") renderer.toneMapping = THREE.AgXToneMapping;
  if (asked.pipeline === "composer") linearComposer(renderer, scene, camera).render();
  else renderer.render(scene, camera);
  const pixels = pixelsOf(renderer.domElement);
  renderer.forceContextLoss();
  return { pixels, by: "WebGL" };
};
`;
const WEBGPU = `${COMMON}
let renderer;
window.draw = async (asked) => {
  const { scene, camera, width, height } = await sceneOf(asked);
  renderer ??= new THREE.WebGPURenderer();
  await renderer.init();
  renderer.setSize(width, height);
  renderer.render(scene, camera);
  return { pixels: pixelsOf(renderer.domElement), by: renderer.backend.isWebGPUBackend ? "WebGPU" : "WebGL" };
};
`;

// Rows of a PNG of 8 bits and RGBA before their filters; decoded here, so that it is not the browser that both draws and judges.
function readPng(path) {
  const file = readFileSync(path);
  const [width, height, depth, kind] = [file.readUInt32BE(16), file.readUInt32BE(20), file[24], file[25]];
  if (depth !== 8 || kind !== 6) throw new Error(`${path} has ${depth} bits and color type ${kind}; expected: 8 and 6`);
  const chunks = [];
  for (let at = 8; at < file.length; at += 12 + file.readUInt32BE(at)) {
    if (file.toString("latin1", at + 4, at + 8) === "IDAT") chunks.push(file.subarray(at + 8, at + 8 + file.readUInt32BE(at)));
  }
  const [stream, stride] = [inflateSync(Buffer.concat(chunks)), 4 * width];
  const pixels = new Uint8Array(stride * height);
  const at = (x, y) => (x < 0 || y < 0 ? 0 : pixels[stride * y + x]);
  for (let y = 0; y < height; y += 1) {
    const filter = stream[(stride + 1) * y];
    for (let x = 0; x < stride; x += 1) {
      const guess = predicted(filter, at(x - 4, y), at(x, y - 1), at(x - 4, y - 1));
      pixels[stride * y + x] = stream[(stride + 1) * y + 1 + x] + guess;
    }
  }
  return { width, height, pixels };
}

function predicted(filter, left, above, corner) {
  if (filter !== 4) return [0, left, above, (left + above) >> 1][filter];
  const [toLeft, toAbove, toCorner] = [left, above, corner].map((value) => Math.abs(left + above - corner - value));
  if (toLeft <= toAbove && toLeft <= toCorner) return left;
  return toAbove <= toCorner ? above : corner;
}

const decoded = (code) => (code <= 0.04045 * 255 ? code / 255 / 12.92 : ((code / 255 + 0.055) / 1.055) ** 2.4);
const encoded = (light) => 255 * (light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055);

// What a frame must look like over a background: codes of the whole picture, three a pixel.
function expected(alpha, { frame, background, mode }) {
  const { info, png } = sheets[alpha];
  const [width, height] = info.picture;
  const cell = info.frames[frame];
  const [read, show] = alpha === "linear" ? [decoded, encoded] : [(code) => code / 255, (value) => 255 * value];
  const codes = new Float64Array(3 * width * height).fill(background);
  for (let y = 0; y < cell.height; y += 1) {
    for (let x = 0; x < cell.width; x += 1) {
      const from = 4 * (png.width * (cell.y + y) + cell.x + x);
      const opacity = png.pixels[from + 3] / 255;
      for (let channel = 0; channel < 3; channel += 1) {
        const light = opacity * read(png.pixels[from + channel]);
        const kept = { cover: 1 - opacity, add: 1, screen: 1 - light }[mode];
        codes[3 * (width * (info.crop.y + y) + info.crop.x + x) + channel] = show(Math.min(light + kept * read(background), 1));
      }
    }
  }
  return codes;
}

// The largest difference of a channel of RGBA `pixels` from `codes`.
function difference(pixels, codes) {
  if (3 * pixels.length !== 4 * codes.length) throw new Error(`the canvas has ${pixels.length / 4} pixels; expected: ${codes.length / 3}`);
  return codes.reduce((worst, code, index) => Math.max(worst, Math.abs(pixels[4 * Math.floor(index / 3) + (index % 3)] - code)), 0);
}

function makeSheet(alpha) {
  const options = ["--grid", GRID, "--size", SIZE, "--crop", "auto", "--alpha", alpha, "--progress", "none", "-o", join(out, `${alpha}.png`)];
  execFileSync(bansho, ["flipbook", "scenes/torch.toml", ...options], { stdio: "inherit" });
  const info = JSON.parse(readFileSync(join(out, `${alpha}.json`), "utf8"));
  if (info.crop.width >= info.picture[0]) throw new Error(`the sheet is not cropped: ${JSON.stringify(info.crop)}`);
  return { info, png: readPng(join(out, info.color.file)) };
}

function writePages() {
  const [sprite, composer] = guideBlocks();
  const files = { "flipbook.js": sprite, "composer.js": composer };
  files["webgl.html"] = html("three.module.js", WEBGL);
  files["webgpu.html"] = html("three.webgpu.js", WEBGPU);
  Object.entries(files).forEach(([name, text]) => writeFileSync(join(out, name), text));
  symlinkSync(resolve(dirname(createRequire(import.meta.url).resolve("three")), ".."), join(out, "three"));
}

rmSync(out, { recursive: true, force: true });
mkdirSync(out, { recursive: true });
const sheets = { encoded: makeSheet("encoded"), linear: makeSheet("linear") };
writePages();
const { server, address } = await serve(out);
const browser = await launch(executablePath);
const errors = [];
const pages = {};
for (const name of ["webgl", "webgpu"]) {
  const page = (pages[name] = await browser.newPage());
  page.on("pageerror", (error) => errors.push(String(error)));
  page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
  await page.goto(`${address}${name}.html`);
  await page.waitForFunction(() => window.draw, null, { timeout: 30000 }).catch(() => errors.push(`${name}.html does not load`));
}
const draw = ({ page, pipeline }, alpha, shown) =>
  pages[page].evaluate((asked) => window.draw(asked), { ...shown, sheet: `/${alpha}.json`, pipeline });
function judge(what, codes, good) {
  console.log(`${good ? "ok  " : "FAIL"}  ${what}: ${codes.toFixed(2)} codes`);
  if (!good) errors.push(what);
}

// Every mode over every background is what the sheet's codes make of it.
async function checkBlending(way) {
  for (const [mode, background] of way.modes.flatMap((mode) => [BLACK, GRAY].map((background) => [mode, background]))) {
    let [worst, by] = [0, ""];
    for (const frame of FRAMES) {
      const drawn = await draw(way, way.alpha, { frame, background, mode });
      worst = Math.max(worst, difference(drawn.pixels, expected(way.alpha, { frame, background, mode })));
      by = drawn.by;
    }
    judge(`${way.name} (${by}), --alpha ${way.alpha}, ${mode}, background ${background}: differs by`, worst, worst <= ALLOWED);
  }
}

// Over black the light itself is seen, so that of the other sheet, blended its own way, is the truth.
async function checkConvention(way) {
  const shown = { frame: FRAMES[1], background: BLACK, mode: "cover" };
  const other = way.alpha === "linear" ? "encoded" : "linear";
  const truth = expected(other, shown);
  const right = difference((await draw(way, way.alpha, shown)).pixels, truth);
  judge(`${way.name}: differs from the flame of --alpha ${other} where that belongs by`, right, right <= SAME_FLAME);
  const wrong = difference((await draw(way, other, shown)).pixels, truth);
  judge(`${way.name}: --alpha ${other}, which does not belong here, is wrong by`, wrong, wrong >= WRONG);
}

// Which mode is nearest to light that adds up, where encoded values are blended: the guide says screen. Means over all pixels that are lit.
function checkNearest() {
  const shown = { frame: FRAMES[1], background: GRAY };
  const truth = expected("linear", { ...shown, mode: "add" });
  const lit = truth.map((code) => Number(Math.round(code) !== GRAY));
  const count = lit.reduce((sum, one) => sum + one, 0);
  const [cover, add, screen] = ["cover", "add", "screen"].map((mode) =>
    expected("encoded", { ...shown, mode }).reduce((sum, code, index) => sum + lit[index] * Math.abs(code - truth[index]), 0) / count);
  const what = `encoded values over ${GRAY}: cover is wrong by ${cover.toFixed(1)}, add by ${add.toFixed(1)}, screen by less than half of that`;
  judge(what, screen, 2 * screen < Math.min(cover, add));
}

if (errors.length === 0) {
  for (const way of PIPELINES) {
    await checkBlending(way);
    await checkConvention(way);
  }
  checkNearest();
}
await browser.close();
server.close();
errors.forEach((error) => console.error(`FAILED: ${error}`));
process.exit(errors.length ? 1 : 0);
