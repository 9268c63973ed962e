//! The program `bansho-studio`: a native window, or a canvas in a web page.

#[cfg(target_arch = "wasm32")]
fn main() {
    match web_sys::window() {
        Some(_) => wasm_bindgen_futures::spawn_local(web::main()),
        // The page's worker runs the same program.
        None => bansho_studio::player::run_worker(),
    }
}

#[cfg(not(target_arch = "wasm32"))]
fn main() -> std::process::ExitCode {
    native::main()
}

#[cfg(target_arch = "wasm32")]
mod web;

#[cfg(not(target_arch = "wasm32"))]
mod native;
