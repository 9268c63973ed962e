// The page as a visitor meets it: loads, shows a picture, answers to hands, gives the scene back.
//   node crates/studio/web/test.mjs DIST [CHROMIUM] [BANSHO]
// It needs playwright-core (npm install playwright-core) and a Chromium; BANSHO checks the scene that was downloaded.
import { spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { launch, serve, SIZE } from "./browser.mjs";

const [dist, executablePath = "/usr/bin/chromium", bansho = "target/debug/bansho"] = process.argv.slice(2);
// Longest that the page may work without answering, and that it may be silent where other programs hold it up too, ms.
const [LONGEST_MS, LONGEST_SILENCE_MS] = [100, 300];
// Where the menu `Recover` stands, after the others.
const RECOVER = { x: 150, y: 12 };

function fail(message) {
  console.error(`FAILED: ${message}`);
  process.exit(1);
}

const { server, address } = await serve(dist);
const browser = await launch(executablePath);
const context = await browser.newContext({ viewport: SIZE, acceptDownloads: true });
const errors = [];

async function open(example, prepare = async () => {}) {
  const page = await context.newPage();
  await prepare(page);
  page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
  page.on("pageerror", (error) => errors.push(String(error)));
  const began = Date.now();
  await page.goto(`${address}#${example}`);
  await page.waitForFunction(() => document.getElementById("status").textContent === "");
  console.log(`${example}: running after ${Date.now() - began} ms`);
  if (Date.now() - began > 5000) fail("it took more than 5 s to load");
  return page;
}

// What a part of the window shows: its mean luminance, the share of the width where the middle of its light lies, and how far any
// pixel is from gray.
async function look(page, clip) {
  const png = (await page.screenshot({ clip })).toString("base64");
  return page.evaluate(async (png) => {
    const bytes = Uint8Array.from(atob(png), (letter) => letter.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
    const canvas = new OffscreenCanvas(image.width, image.height);
    const drawing = canvas.getContext("2d");
    drawing.drawImage(image, 0, 0);
    const { data } = drawing.getImageData(0, 0, image.width, image.height);
    let [sum, moment, color] = [0, 0, 0];
    for (let pixel = 0; pixel < data.length / 4; pixel += 1) {
      const light = 0.2126 * data[4 * pixel] + 0.7152 * data[4 * pixel + 1] + 0.0722 * data[4 * pixel + 2];
      sum += light;
      moment += light * (pixel % image.width);
      const channels = data.subarray(4 * pixel, 4 * pixel + 3);
      color = Math.max(color, Math.max(...channels) - Math.min(...channels));
    }
    return { mean: sum / (data.length / 4), middle: moment / Math.max(sum, 1) / image.width, color };
  }, png);
}

// Whether a flame or an aurora is seen: the panel that waits for the first picture is gray.
const isDrawn = ({ mean, color }) => mean > 1.5 && color > 40;

async function until(page, clip, wanted, what, seconds = 60) {
  const end = Date.now() + 1000 * seconds;
  let seen;
  do {
    seen = await look(page, clip);
    if (wanted(seen)) return seen;
    await page.waitForTimeout(250);
  } while (Date.now() < end);
  await page.screenshot({ path: join(tmpdir(), "studio-failed.png") });
  fail(`${what}; saw ${JSON.stringify(seen)}`);
}

// The longest task of the page's own thread while `hands` did something and for `seconds` after: how long that thread
// worked, and how long it was silent, which other programs lengthen; ms. Taking pictures of the page stops it too, so
// none are taken meanwhile.
async function longestTask(page, seconds, hands) {
  await browser.startTracing(page, { categories: ["toplevel", "-*"] });
  await hands();
  await page.waitForTimeout(1000 * seconds);
  const { traceEvents } = JSON.parse((await browser.stopTracing()).toString());
  const thread = ({ pid, tid }) => `${pid} ${tid}`;
  const named = traceEvents.filter(({ ph, name, args }) => ph === "M" && name === "thread_name" && args.name === "CrRendererMain");
  const own = new Set(named.map(thread));
  const tasks = traceEvents.filter((event) => event.ph === "X" && own.has(thread(event)));
  if (tasks.length === 0) fail("the browser's trace names no task of the page");
  const longest = (lengths) => Math.max(...lengths) / 1000;
  return { work: longest(tasks.map(({ tdur, dur }) => tdur ?? dur)), silence: longest(tasks.map(({ dur }) => dur)) };
}

// The page must answer while `hands` work. What it does itself must be short each time; of silence, the best of eight
// tries counts.
async function mustNotFreeze(page, what, seconds, hands) {
  const tried = [];
  do {
    tried.push(await longestTask(page, seconds, () => hands(tried.length)));
  } while (tried.at(-1).silence > LONGEST_MS && tried.length < 8);
  const all = (key) => tried.map((task) => task[key].toFixed(0)).join(", then ");
  console.log(`${what}: the page worked for at most ${all("work")} ms, and was silent for ${all("silence")} ms`);
  if (!tried.every(({ work }) => work <= LONGEST_MS)) fail(`${what}: the page froze`);
  if (!tried.some(({ silence }) => silence <= LONGEST_SILENCE_MS)) fail(`${what}: the page was silent`);
}

async function stroke(page, points) {
  await page.mouse.move(...points[0]);
  await page.mouse.down();
  for (const point of points.slice(1)) await page.mouse.move(...point, { steps: 8 });
  await page.mouse.up();
}

// The file chooser that Ctrl+O opens. Keys count once the canvas has them, which the first frame does not promise.
async function chooserOf(page, tries = 4) {
  const chooser = page.waitForEvent("filechooser", { timeout: 5000 }).catch(() => null);
  await page.keyboard.press("Control+o");
  return (await chooser) ?? (tries > 1 ? chooserOf(page, tries - 1) : fail("no file chooser opens"));
}

// A flame bends with a dragged wind. The picture lies between the panels.
const picture = { x: 215, y: 60, width: 840, height: 660 };
const flame = await open("torch");
const still = await until(flame, picture, isDrawn, "no picture of a flame");
console.log(`a flame: mean ${still.mean.toFixed(1)}, middle ${still.middle.toFixed(3)}`);
await flame.mouse.click(298, 44);
await mustNotFreeze(flame, "blowing", 3, async (tried) => {
  if (tried > 0) await flame.mouse.up();
  await flame.mouse.move(635, 400);
  await flame.mouse.down();
  await flame.mouse.move(935, 400, { steps: 10 });
});
// Where the hand went: to the right.
const blown = await until(flame, picture, ({ middle }) => middle > still.middle + 0.01, "the wind does not bend it to the right");
console.log(`blown: middle ${blown.middle.toFixed(3)}`);
await flame.mouse.up();
await mustNotFreeze(flame, "playing", 3, async (tried) => {
  if (tried > 0) await flame.keyboard.press("Space");
  await flame.keyboard.press("Space");
});
await flame.close();

// A stroke makes an aurora. The editor's squares lie below the picture. Few kilorayleighs: a sky that is bright already hides a stroke.
const sky = await open("quiet_arc");
const above = { x: 370, y: 60, width: 530, height: 220 };
const bright = await until(sky, above, isDrawn, "no aurora", 120);
const faint = `bansho = 2
[camera]
target = [0.0, 28.0, -60.0]
vertical_fov_deg = 54.0
[picture]
exposure_ev100 = -5.0
[[aurora]]
flux_mw_per_m2 = 20.0
[[aurora.shapes]]
sheets = [{ form = "arc", length_km = 200.0, position_km = [0.0, -190.0] }]
`;
await (await chooserOf(sky)).setFiles({ name: "faint.toml", mimeType: "text/plain", buffer: Buffer.from(faint) });
const alone = await until(sky, above, (seen) => isDrawn(seen) && seen.mean < 0.5 * bright.mean, "no faint aurora", 120);
const square = { x: 584, y: 417, side: 365 };
const at = (x, y) => [square.x + x * square.side, square.y + y * square.side];
await mustNotFreeze(sky, "drawing", 6, (tried) => {
  const below = 0.32 + 0.06 * tried;
  return stroke(sky, [at(0.08, below), at(0.35, below - 0.06), at(0.65, below + 0.01), at(0.92, below - 0.05)]);
});
const joined = await until(sky, above, ({ mean }) => mean > 1.1 * alone.mean, "the stroke makes no aurora", 60);
console.log(`a stroke: mean ${alone.mean.toFixed(1)} became ${joined.mean.toFixed(1)}`);
// Whether the browser keeps unsaved work with a stroke in it, of whichever page.
const keeps = () =>
  Object.keys(localStorage).some((key) => key.startsWith("bansho-studio unsaved ") && /points = \[\[/.test(localStorage.getItem(key)));
await sky.waitForFunction(keeps, null, { timeout: 20000 });
console.log("the browser keeps it while it is unsaved");
// Another page has nothing to keep, and leaves it there.
const other = await open("torch");
await until(other, picture, isDrawn, "no picture of a flame");
await other.waitForTimeout(8000);
if (!(await other.evaluate(keeps))) fail("another page forgot what this one keeps");
await other.close();
// Leaving the page asks.
const [question] = await Promise.all([sky.waitForEvent("dialog", { timeout: 20000 }), sky.close({ runBeforeUnload: true })]);
if (question.type() !== "beforeunload") fail(`leaving with unsaved work asks ${question.type()}`);
await question.dismiss();
console.log("leaving with unsaved work asks, and another page leaves it alone");
await sky.bringToFront();
const [download] = await Promise.all([sky.waitForEvent("download"), sky.keyboard.press("Control+s")]);
const saved = join(mkdtempSync(join(tmpdir(), "studio-")), "drawn.toml");
await download.saveAs(saved);
const text = readFileSync(saved, "utf8");
if (!/points = \[\[/.test(text)) fail(`the stroke is not in the scene:\n${text}`);
const checked = spawnSync(bansho, ["check", saved], { encoding: "utf8" });
if (checked.status !== 0) fail(`bansho check: ${checked.stderr || checked.error}`);
console.log("the stroke is in the scene that was downloaded, which passes bansho check");
// What was saved is kept no more; what is drawn then outlives its page, and the next page gives it back.
const keepsNone = () =>
  !Object.keys(localStorage).some((key) => key.startsWith("bansho-studio unsaved ") && /points = \[\[/.test(localStorage.getItem(key)));
await sky.waitForFunction(keepsNone, null, { timeout: 20000 });
await stroke(sky, [at(0.1, 0.9), at(0.5, 0.86), at(0.9, 0.9)]);
await sky.waitForFunction(keeps, null, { timeout: 20000 });
await sky.close();
const heir = await open("torch");
await until(heir, picture, isDrawn, "no picture of a flame");
await heir.mouse.click(RECOVER.x, RECOVER.y);
await heir.waitForTimeout(500);
await heir.mouse.click(RECOVER.x + 20, RECOVER.y + 28);
await heir.waitForTimeout(1500);
const [given] = await Promise.all([heir.waitForEvent("download", { timeout: 20000 }), heir.keyboard.press("Control+s")]);
const recovered = join(mkdtempSync(join(tmpdir(), "studio-")), "recovered.toml");
await given.saveAs(recovered);
if (!/points = \[\[/.test(readFileSync(recovered, "utf8"))) fail("the next page does not give back what was unsaved");
console.log("what a page left unsaved is recovered by the next one");
await heir.close();

// A scene of the user's own is opened through the browser, and its still and its shot come back.
const small = `bansho = 2
[picture]
size = [64, 36]
frames = 4
[[flame_particles]]
particles = 200
preroll_s = 0.2
`;
const own = await open("torch");
await until(own, picture, isDrawn, "no picture of a flame");
const chooser = await chooserOf(own);
await chooser.setFiles({ name: "small.toml", mimeType: "text/plain", buffer: Buffer.from(small) });
await own.waitForTimeout(2000);
async function rendered(keys) {
  const [download] = await Promise.all([own.waitForEvent("download", { timeout: 120000 }), own.keyboard.press(keys)]);
  const path = join(mkdtempSync(join(tmpdir(), "studio-")), download.suggestedFilename());
  await download.saveAs(path);
  return { path, name: download.suggestedFilename() };
}
// Faults, as of a plate that is missing beside a flame of many particles, are told by the worker: nothing heavy is made here.
const faulty = `bansho = 2\n[plate]\nimage = "gone.png"\n[[flame_particles]]\nparticles = 30000\n[[aurora]]\n`;
for (const [what, name, scene] of [
  ["a faulty scene", "faulty.toml", faulty],
  ["a heavy scene", "heavy.toml", faulty.replace(/\[plate\]\nimage.*\n/, "")],
  ["a small scene again", "small.toml", small],
]) {
  await mustNotFreeze(own, what, 4, async () => {
    const asked = await chooserOf(own);
    await asked.setFiles({ name, mimeType: "text/plain", buffer: Buffer.from(scene) });
  });
}
await own.waitForTimeout(2000);
await own.evaluate(() => addEventListener("keydown", (event) => (window.lastKey = event), true));
const one = await rendered("F12");
if (!(await own.evaluate(() => window.lastKey.key === "F12" && window.lastKey.defaultPrevented))) fail("F12 opens the browser's tools too");
if (one.name !== "small.0000.png") fail(`the still is called ${one.name}`);
const shot = await rendered("Shift+F12");
if (shot.name !== "small.zip") fail(`the shot is called ${shot.name}`);
const look_into = `import sys, zipfile
shot = zipfile.ZipFile(sys.argv[1])
assert shot.testzip() is None
assert shot.namelist() == [f"small.{number:04}.png" for number in range(4)], shot.namelist()
assert shot.read("small.0000.png") == open(sys.argv[2], "rb").read(), "the first frame is not the still"`;
const zipped = spawnSync("python3", ["-c", look_into, shot.path, one.path], { encoding: "utf8" });
if (zipped.status !== 0) fail(`the shot: ${zipped.stderr || zipped.error}`);
console.log("a scene was opened; its still and its shot were rendered");
await own.close();

// A picture of the user's own becomes the plate behind the flame; it is read and drawn by the worker.
const plated = await open("torch");
const dark = await until(plated, picture, isDrawn, "no picture of a flame");
await mustNotFreeze(plated, "a plate", 4, async () => {
  const asked = await chooserOf(plated);
  await asked.setFiles(fileURLToPath(new URL("../../../scenes/plates/garden.jpg", import.meta.url)));
});
const lit = await until(plated, picture, ({ mean }) => mean > 4 * dark.mean, "no plate behind the flame");
console.log(`before a plate: mean ${lit.mean.toFixed(1)}, alone ${dark.mean.toFixed(1)}`);
await plated.close();

// The plate of an example lies beside the page, and is fetched before anything is drawn.
const answers = [];
const hearth = await open("hearth", async (page) => {
  page.on("response", (response) => response.url().includes("/scenes/plates/") && answers.push(response.status()));
});
await until(hearth, picture, isDrawn, "no picture of a fire in a hearth");
if (answers.length !== 2 || answers.some((status) => status !== 200)) fail(`the plates of the hearth: ${answers}`);
const faults = await hearth.evaluate(() => document.getElementById("notice").textContent);
if (faults !== "") fail(`with its plates the page says: ${faults}`);
await hearth.close();
// A page without plates says so. Its context is not among those whose console must stay silent.
const bare = await (await browser.newContext({ viewport: SIZE })).newPage();
await bare.route("**/scenes/plates/*", (route) => route.fulfill({ status: 404 }));
await bare.goto(`${address}#hearth`);
await bare.waitForFunction(() => /plates.*answers 404/.test(document.getElementById("notice").textContent), null, { timeout: 20000 });
await bare.close();
console.log("the plate of an example is fetched, and a page that has none says so");

// A panic is told once, and another worker goes on. No scene panics, so the words are put into the worker's mouth: its last
// ones, and then the trap.
const panicking = await open("torch", (page) => page.addInitScript(() => {
  window.drawn = [];
  const Plain = window.Worker;
  window.Worker = class extends Plain {
    constructor(...given) {
      super(...given);
      const own = window.drawn.push(0) - 1;
      this.addEventListener("message", ({ data }) => (window.drawn[own] += data[0] === "drawn" ? 1 : 0));
    }
    postMessage(message, ...rest) {
      if (!window.breaks || message[0] !== "request") return super.postMessage(message, ...rest);
      window.breaks = false;
      setTimeout(() => {
        this.dispatchEvent(new MessageEvent("message", { data: ["panicked", message[1], "broken on purpose"] }));
        this.dispatchEvent(new Event("error"));
      });
    }
  };
}));
await until(panicking, picture, isDrawn, "no picture of a flame");
const workers = await panicking.evaluate(() => window.drawn.length);
await panicking.mouse.click(635, 700);
await panicking.evaluate(() => (window.breaks = true));
await panicking.keyboard.press("ArrowRight");
const told = () => panicking.evaluate(() => document.getElementById("notice").textContent);
await panicking.waitForFunction(() => /panicked.*broken on purpose/.test(document.getElementById("notice").textContent), null, { timeout: 20000 });
await panicking.keyboard.press("ArrowRight");
await panicking.waitForFunction((workers) => window.drawn[workers] > 0, workers, { timeout: 30000 });
await panicking.waitForTimeout(2000);
if (!/broken on purpose/.test(await told())) fail(`after a panic the page says: ${await told()}`);
if ((await panicking.evaluate(() => window.drawn.length)) !== workers + 1) fail("a healthy worker was replaced");
console.log("a panic is told once, and another worker goes on");
await panicking.close();

await browser.close();

// What somebody smuggled into the page could neither run nor tell anybody.
async function isShut(page) {
  const violated = (name) => page.evaluate((name) => new Promise((resolve) => {
    document.addEventListener("securitypolicyviolation", (event) => resolve(event.effectiveDirective), { once: true });
    const script = document.createElement("script");
    if (name === "script") script.textContent = "window.smuggled = true";
    if (name === "script") document.head.append(script);
    else fetch("http://127.0.0.1:9/").catch(() => {});
    setTimeout(() => resolve("nothing"), 5000);
  }), name);
  if (!/^script-src/.test(await violated("script"))) fail("a script within the page runs");
  if (await page.evaluate(() => window.smuggled)) fail("a script within the page ran");
  if ((await violated("fetch")) !== "connect-src") fail("the page may ask other servers");
}

// Without WebGPU the page works by WebGL; without either it says what it needs.
async function elsewhere(graphics, wanted, what) {
  const plain = await launch(executablePath, graphics);
  const page = await (await plain.newContext({ viewport: SIZE })).newPage();
  await page.goto(`${address}#torch`);
  await wanted(page);
  console.log(what);
  await plain.close();
}
await elsewhere(["--disable-features=WebGPU", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"], async (page) => {
  if (await page.evaluate(async () => Boolean(await navigator.gpu?.requestAdapter()))) fail("this browser has WebGPU after all");
  await page.waitForFunction(() => document.getElementById("status").textContent === "", null, { timeout: 30000 });
  await until(page, picture, isDrawn, "no picture by WebGL");
  await isShut(page);
}, "without WebGPU it works by WebGL; its content security policy holds");
await elsewhere(["--disable-features=WebGPU", "--disable-gpu", "--disable-3d-apis"], async (page) => {
  await page.waitForFunction(() => /needs WebGPU or WebGL 2/.test(document.getElementById("status").textContent), null, { timeout: 30000 });
}, "without WebGPU and WebGL it says what it needs");
server.close();
if (errors.length > 0) fail(`the console has errors:\n${errors.join("\n")}`);
console.log("the page works");
