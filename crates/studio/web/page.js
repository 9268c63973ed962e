// Starts the studio in its page.
import init from "./bansho_studio.js";
init().catch((reason) => {
  document.getElementById("status").textContent = `The studio cannot start here: ${reason}`;
});
