//! The last step of a build of the studio's page: `bansho-studio-bindgen WASM OUT` writes what a browser loads, `OUT/bansho_studio.js` and
//! `OUT/bansho_studio_bg.wasm`, as `wasm-bindgen --target web --no-typescript --out-name bansho_studio` does.

use std::{env, error::Error, path::PathBuf};

use wasm_bindgen_cli_support::Bindgen;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<PathBuf> = env::args_os().skip(1).map(PathBuf::from).collect();
    let [wasm, out] = arguments.as_slice() else { return Err("usage: bansho-studio-bindgen WASM OUT".into()) };
    let mut bindgen = Bindgen::new();
    // Without a path the JavaScript loads the module that lies beside it.
    bindgen.input_path(wasm).out_name("bansho_studio").typescript(false).omit_default_module_path(false).web(true)?;
    Ok(bindgen.generate(out)?)
}
