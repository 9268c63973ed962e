//! Valid scenes whose every value the fuzzer chooses: all draw finite pictures.
#![no_main]

use bansho_base::{host::assets::MemoryAssets, parameters::{self, Table}};
use bansho::KINDS;
use bansho_scene::Scene;
use bansho_fuzz::{draw_small, one_thread};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    one_thread();
    let mut pairs = bytes.chunks_exact(2);
    let mut uniform = || pairs.next().map_or(0.75, |pair| f64::from(u16::from_le_bytes([pair[0], pair[1]])) / 65536.0);
    let mut text = String::from("bansho = 2\n");
    for kind in KINDS.iter().filter(|kind| kind.key != "plate") {
        text += &table_text(&kind.header(), &parameters::sample((kind.table)(), &mut uniform));
    }
    // Values that do not go together, such as A + D above 1, are refused; each alone is valid.
    if let Ok(scene) = Scene::parse("fuzz.toml", &text, KINDS) {
        draw_small(scene, MemoryAssets::default());
    }
});

fn table_text(header: &str, table: &Table) -> String {
    let lines = table.entries.iter().map(|entry| format!("{} = {}\n", entry.key, entry.node.value));
    format!("{header}\n{}", lines.collect::<String>())
}
