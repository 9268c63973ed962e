//! Small frames of every phenomenon, compared by the bytes with those of `small_frames.txt`, in whatever way the library divides its work.
//!
//! With its default features the library draws them in a pool of three threads. `cargo test -p bansho --test small_frames --no-default-features
//! --features fire,rain,aurora` draws the same bytes on the calling thread alone. `BANSHO_BLESS=1` rewrites the file; the reason goes into
//! CHANGELOG.md under "Changes the picture".
#![cfg(all(feature = "fire", feature = "rain", feature = "aurora"))]

use std::{
    collections::BTreeSet,
    fmt::Write,
    path::Path,
    sync::{Arc, Mutex},
    thread::{self, ThreadId},
};

use bansho::{
    AlphaConvention, BitDepth, Frame, MemoryAssets, Observer, Plan, PlanOptions, Shot, Stage, View,
    base::frame::DisplayPixels, compile_scene,
};

/// Names of scenes, with the frame that is drawn and all of their text but the first table.
const SCENES: [(&str, i64, &str); 5] = [
    ("flame sheet", 20, "[[flame_sheet]]\n"),
    (
        "particle flame",
        2,
        "[ground]\nwetness = 0.8\n[[flame_particles]]\nname = \"flame\"\nparticles = 9000\nstep_s = 0.0166666667\n\
         [[flame_particles.burners]]\nheat_release_kw = 32\n[flame_particles.rendering]\nheat_haze_gain = 14.0\n",
    ),
    ("rain", 3, "[[rain]]\n"),
    (
        "aurora",
        2,
        "[ground]\nkind = \"water\"\n[[aurora]]\nparticles = { count = 10000 }\n[[aurora.shapes]]\nsheets = [{ form = \"arc\" }]\n\
         [[aurora.shapes]]\nsheets = [{ form = \"spiral\" }]\n",
    ),
    (
        "aurora of single collisions",
        0,
        "[[aurora]]\nparticles = { count = 2000 }\nrendering = { sampling = \"single_collisions\" }\n",
    ),
];

/// The threads on which the library calls its observer: each that draws a strip of the picture.
#[derive(Default)]
struct ThreadObserver(Mutex<Vec<ThreadId>>);

impl ThreadObserver {
    fn note(&self) {
        self.0.lock().unwrap().push(thread::current().id());
    }
}

impl Observer for ThreadObserver {
    fn begin(&self, _stage: Stage) {
        self.note();
    }

    fn cancelled(&self) -> bool {
        self.note();
        false
    }
}

/// FNV-1a of 64 bits.
struct Hash(u64);

impl Hash {
    fn add(&mut self, bytes: impl IntoIterator<Item = u8>) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        }
    }

    fn add_all<'a>(&mut self, values: impl IntoIterator<Item = &'a f32>) {
        values.into_iter().for_each(|value| self.add(value.to_bits().to_le_bytes()));
    }
}

/// The frame with depth, layers and measured quantities, and what a display shows of it.
fn hash(frame: &Frame) -> u64 {
    let mut hash = Hash(0xcbf2_9ce4_8422_2325);
    hash.add_all(frame.beauty.pixels().as_flattened());
    hash.add_all(frame.depth.iter().flatten());
    hash.add_all(frame.channels.iter().flat_map(|channel| &channel.values));
    match bansho::display(frame, &View::DISPLAY, BitDepth::Eight, AlphaConvention::Encoded).pixels {
        DisplayPixels::Eight(pixels) => hash.add(pixels.into_iter().flatten()),
        other => panic!("8 bits were asked for, not {other:?}"),
    }
    hash.0
}

fn draw(name: &str, number: i64, tables: &str, observer: &dyn Observer) -> Frame {
    let text = format!("bansho = 2\n[picture]\nsize = [48, 27]\n{tables}");
    let compiled =
        compile_scene(name, &text, Arc::new(MemoryAssets::default())).unwrap_or_else(|error| panic!("{error}"));
    let options = PlanOptions { layers: true, aovs: true, ..PlanOptions::default() };
    let plan = Arc::new(Plan::new(&compiled, &options).unwrap());
    bansho::draw(&mut Shot::open(compiled, plan), number, observer).unwrap()
}

#[test]
fn small_frames_are_the_same_bytes_with_and_without_the_feature_rayon() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let pool_threads: BTreeSet<String> =
        pool.broadcast(|_| format!("{:?}", thread::current().id())).into_iter().collect();
    let mut drawn = String::new();
    for (name, number, tables) in SCENES {
        let observer = ThreadObserver::default();
        let (frame, caller) = pool.install(|| (draw(name, number, tables, &observer), thread::current().id()));
        assert!(frame.beauty.pixels().iter().any(|pixel| pixel[1] > 0.01), "{name}: something is seen");
        writeln!(drawn, "{name}: {:016x}", hash(&frame)).unwrap();
        for id in observer.0.into_inner().unwrap() {
            assert!(pool_threads.contains(&format!("{id:?}")), "{name}: work left the caller's pool");
            assert!(cfg!(feature = "rayon") || id == caller, "{name}: work left the caller's thread");
        }
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/small_frames.txt");
    if std::env::var_os("BANSHO_BLESS").is_some() {
        std::fs::write(&path, drawn).unwrap();
        return;
    }
    let known = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    assert_eq!(drawn, known, "if this is intended, run BANSHO_BLESS=1 cargo test -p bansho --test small_frames");
}
