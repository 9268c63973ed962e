// How fast the page plays: pictures a second of the examples, by what its worker says.
//   node crates/studio/web/bench.mjs DIST CHROMIUM SECONDS EXAMPLE...
import { launch, serve, SIZE } from "./browser.mjs";

const [dist, executablePath, seconds, ...examples] = process.argv.slice(2);
const { server, address } = await serve(dist);
const browser = await launch(executablePath);
const context = await browser.newContext({ viewport: SIZE });
// What the worker draws: when, how large, and what drawing and simulating took.
await context.addInitScript(() => {
  window.drawn = [];
  const Plain = window.Worker;
  window.Worker = class extends Plain {
    constructor(...given) {
      super(...given);
      this.addEventListener("message", ({ data }) => {
        if (!Array.isArray(data) || data[0] !== "drawn") return;
        const [width, height] = data.slice(3, 5);
        const [draw, advance] = data.slice(-2);
        window.drawn.push({ at: performance.now(), width, height, draw, advance });
      });
    }
  };
});
const middle = (values) => values.toSorted((a, b) => a - b)[Math.floor(values.length / 2)] ?? NaN;
for (const example of examples) {
  const page = await context.newPage();
  await page.goto(`${address}#${example}`);
  await page.waitForFunction(() => window.drawn.length > 0, null, { timeout: 120000 });
  const whole = (await page.evaluate(() => window.drawn))[0];
  await page.keyboard.press("Space");
  // Until the preview has found its size.
  await page.waitForTimeout(2000);
  const drawn = await page.evaluate(async (seconds) => {
    window.drawn = [];
    await new Promise((later) => setTimeout(later, 1000 * seconds));
    return window.drawn;
  }, Number(seconds));
  const last = drawn.at(-1) ?? whole;
  const [draw, advance] = ["draw", "advance"].map((key) => (1000 * middle(drawn.map((one) => one[key]))).toFixed(0));
  const whole_ms = (1000 * (whole.draw + whole.advance)).toFixed(0);
  console.log(
    `${example.padEnd(22)} ${(drawn.length / seconds).toFixed(1).padStart(5)} pictures/s at ${last.width} x ${last.height}` +
      ` (${advance} ms simulated, ${draw} ms drawn); first picture ${whole.width} x ${whole.height} in ${whole_ms} ms`,
  );
  await page.close();
}
await browser.close();
server.close();
