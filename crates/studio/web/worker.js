// The page's second thread: the same program, handed over compiled, which sees that it has no window and draws.
import init from "./bansho_studio.js";
onmessage = ({ data }) => {
  onmessage = null;
  init({ module_or_path: data });
};
