use std::{
    sync::{Arc, mpsc},
    time::Duration,
};

use bansho::{
    AlphaConvention, Assets, BitDepth, CompiledScene, MemoryAssets, Plan, PlanOptions, SceneOptions, Shot, Unobserved,
    View,
    base::{
        frame::DisplayPixels,
        geometry::{mesh::Mesh, strokes::Drawing},
        host::assets::{AssetError, Picture as Plate},
    },
    display, parse_scene,
};

use super::*;
use crate::document::Document;

const SCENE: &str = "bansho = 2\n[picture]\nsize = [64, 36]\nframes = 20\n[[flame_sheet]]\n";
const STEPPED: &str =
    "bansho = 2\n[picture]\nsize = [64, 36]\nframes = 20\n[[flame_particles]]\nparticles = 200\npreroll_s = 0.1\n";

pub(super) fn request(text: &str, number: i64) -> FrameRequest {
    FrameRequest {
        revision: Document::new("", "").revision(),
        name: "scene".into(),
        text: text.into(),
        assets: Arc::new(MemoryAssets::default()),
        number: Some(number),
        within: [10_000; 2],
        exact: false,
        draft: false,
        full_quality: false,
        stages: None,
    }
}

fn process(engine: &mut engine::Engine, request: &FrameRequest) -> Vec<Event> {
    let mut events = Vec::new();
    engine.process(request, &Unobserved, &mut |event| events.push(event)).unwrap();
    events
}

fn picture(events: Vec<Event>) -> Picture {
    let drawn = events.into_iter().find_map(|event| match event {
        Event::Drawn(picture) => Some(picture),
        _ => None,
    });
    drawn.expect("a picture")
}

/// The frame of `bansho render`, over black.
fn rendered(text: &str, number: i64) -> Vec<[u8; 4]> {
    rendered_with_alpha(text, number, true)
}

fn rendered_with_alpha(text: &str, number: i64, opaque: bool) -> Vec<[u8; 4]> {
    let assets: Arc<dyn Assets> = Arc::new(MemoryAssets::default());
    let scene = Arc::new(parse_scene("scene", text).unwrap().with_options(&SceneOptions::default()).unwrap());
    let compiled = Arc::new(CompiledScene::build(scene, assets, None).unwrap());
    // As `bansho render` writes it for display.
    let options = PlanOptions { glare: bansho::GlareUse::Always, ..PlanOptions::default() };
    let plan = Plan::new(&compiled, &options).unwrap();
    let mut shot = Shot::open(compiled, Arc::new(plan));
    let mut frame = bansho::draw(&mut shot, number, &Unobserved).unwrap();
    frame.opaque = opaque;
    match display(&frame, &View::DISPLAY, BitDepth::Eight, AlphaConvention::Encoded).pixels {
        DisplayPixels::Eight(pixels) => pixels,
        DisplayPixels::Sixteen(_) => unreachable!("eight bits were asked for"),
    }
}

#[test]
fn a_preview_at_full_size_equals_the_rendered_frame() {
    let mut engine = engine::Engine::default();
    for (text, number) in [(SCENE, 7), (STEPPED, 9), (STEPPED, 3)] {
        let request = FrameRequest { revision: new_revision(text), ..request(text, number) };
        let drawn = picture(process(&mut engine, &request));
        assert!(drawn.exact || text == STEPPED);
        let exact = picture(process(&mut engine, &FrameRequest { exact: true, ..request }));
        assert_eq!((exact.size, exact.exact), ([64, 36], true));
        assert!(exact.pixels == rendered(text, number), "frame {number}");
        assert!(exact.pixels.iter().any(|pixel| pixel[0] > 0), "it is not black");
    }
}

/// A new revision.
fn new_revision(text: &str) -> crate::document::Revision {
    Document::new("", text).revision()
}

#[test]
fn each_revision_is_checked_once() {
    let mut engine = engine::Engine::default();
    let checked = |events: Vec<Event>| events.iter().filter(|event| matches!(event, Event::Checked { .. })).count();
    let first = request(SCENE, 0);
    let second = request(STEPPED, 0);
    assert_eq!([&first, &first, &second].map(|request| checked(process(&mut engine, request))), [1, 0, 1]);
    assert!(picture(process(&mut engine, &FrameRequest { exact: true, ..second })).pixels == rendered(STEPPED, 0));
}

#[test]
fn small_windows_get_small_pictures_with_the_same_aspect_ratio() {
    let drawn =
        picture(process(&mut engine::Engine::default(), &FrameRequest { within: [32, 400], ..request(SCENE, 0) }));
    assert_eq!((drawn.size, drawn.scene_size, drawn.pixels.len()), ([32, 18], [64, 36], 32 * 18));
}

#[test]
fn seeking_back_draws_the_same_picture() {
    let mut engine = engine::Engine::default();
    let first = picture(process(&mut engine, &request(STEPPED, 11)));
    process(&mut engine, &request(STEPPED, 19));
    let again = picture(process(&mut engine, &request(STEPPED, 11)));
    assert!(again.exact && again.pixels == first.pixels);
}

#[test]
fn a_changed_wind_continues_from_the_current_state() {
    let mut engine = engine::Engine::default();
    process(&mut engine, &request(STEPPED, 10));
    let text = format!("{STEPPED}[wind]\nvelocity = [2.0, 0, 0]\n");
    let blown = FrameRequest { revision: new_revision(&text), ..request(&text, 11) };
    assert!(!picture(process(&mut engine, &blown)).exact);
    let exact = picture(process(&mut engine, &FrameRequest { exact: true, ..blown }));
    assert!(exact.exact && exact.pixels == rendered(&text, 11));
}

#[test]
fn with_problems_the_last_valid_scene_is_drawn() {
    let mut engine = engine::Engine::default();
    let good = picture(process(&mut engine, &request(SCENE, 4)));
    let faulty = FrameRequest { revision: new_revision(SCENE), ..request("bansho = 2\n[[flame_shet]]\n", 4) };
    let events = process(&mut engine, &faulty);
    assert!(matches!(&events[0], Event::Checked { outcome: Err(error), .. } if error.problems.len() == 1));
    assert!(picture(events).pixels == good.pixels);
}

#[test]
fn time_slices_draw_the_same_picture() {
    let mut player = PolledPlayer::default();
    player.request(request(STEPPED, 9));
    let mut events = Vec::new();
    while player.is_busy() {
        events.extend(player.poll());
    }
    assert!(picture(events).pixels == rendered(STEPPED, 9));
}

/// The next events of a player on a thread.
fn wait(player: &mut ThreadPlayer, woken: &mpsc::Receiver<()>) -> Vec<Event> {
    woken.recv_timeout(Duration::from_secs(60)).expect("something happens");
    player.poll()
}

#[test]
fn only_the_newest_request_is_served() {
    let (sender, woken) = mpsc::channel();
    let mut player = ThreadPlayer::start(move || sender.send(()).unwrap_or_default()).unwrap();
    for number in 0..20 {
        player.request(request(SCENE, number));
    }
    let mut drawn = Vec::new();
    while drawn.last() != Some(&19) {
        let numbers = wait(&mut player, &woken).into_iter().filter_map(|event| match event {
            Event::Drawn(picture) => Some(picture.number),
            _ => None,
        });
        drawn.extend(numbers);
    }
    assert!(drawn.len() < 20, "older requests are skipped: {drawn:?}");
    assert!(drawn.is_sorted());
}

/// Assets that panic.
pub(crate) struct PanickingAssets;

impl Assets for PanickingAssets {
    fn picture(&self, _: &str, _: i64) -> Result<Arc<Plate>, AssetError> {
        panic!("broken on purpose")
    }
    fn mesh(&self, _: &str) -> Result<Arc<Mesh>, AssetError> {
        panic!("broken on purpose")
    }
    fn drawing(&self, _: &str) -> Result<Arc<Drawing>, AssetError> {
        panic!("broken on purpose")
    }
    fn text(&self, _: &str) -> Result<Arc<str>, AssetError> {
        panic!("broken on purpose")
    }
    fn digest(&self, _: &str, _: i64) -> Result<[u8; 32], AssetError> {
        panic!("broken on purpose")
    }
}

#[test]
fn a_panic_is_reported_and_the_player_continues() {
    let (sender, woken) = mpsc::channel();
    let mut player = ThreadPlayer::start(move || sender.send(()).unwrap_or_default()).unwrap();
    let text = format!("{SCENE}[plate]\nimage = \"plate.png\"\n");
    player.request(FrameRequest { assets: Arc::new(PanickingAssets), ..request(&text, 0) });
    let events = wait(&mut player, &woken);
    assert!(matches!(&events[..], [Event::Panicked { message, .. }] if message == "broken on purpose"));
    player.request(FrameRequest { revision: new_revision(&text), ..request(SCENE, 0) });
    while !wait(&mut player, &woken).iter().any(|event| matches!(event, Event::Drawn(_))) {}
}

fn playing() -> Transport {
    let mut transport = Transport::default();
    transport.set_shot(10..=19, 10.0);
    transport.set_playing(true);
    transport
}

#[test]
fn frames_follow_when_they_are_due_and_the_previous_was_shown() {
    let mut transport = playing();
    assert_eq!(transport.number(), 10);
    assert!(!transport.tick(5.0, true) && !transport.tick(5.09, true));
    assert!(!transport.tick(5.11, false), "the first frame is not there yet");
    assert!(transport.tick(5.11, true));
    assert_eq!(transport.number(), 11);
    assert!((transport.sleep_s(5.15).unwrap() - 0.05).abs() < 1e-9);
    assert!(transport.tick(5.35, true));
    assert_eq!(transport.number(), 13, "a late frame is left out");
    assert!(transport.tick(60.0, true));
    assert_eq!(transport.number(), 17, "but never many");
}

#[test]
fn a_recording_ends_where_the_shot_does() {
    let mut transport = playing();
    transport.go_to(17);
    transport.play_to_the_end();
    let now = |step: i32| 5.0 + 0.101 * f64::from(step);
    let numbers: Vec<i64> = (0..6)
        .map(|step| {
            transport.tick(now(step), true);
            transport.number()
        })
        .collect();
    assert_eq!(numbers, [17, 18, 19, 19, 19, 19]);
    assert!(!transport.is_playing());
    transport.set_playing(true);
    transport.tick(6.0, true);
    transport.tick(6.11, true);
    assert_eq!(transport.number(), 10, "playing begins again");
}

#[test]
fn the_range_repeats_and_stays_within_the_shot() {
    let mut transport = playing();
    transport.set_range(Some(12..=13));
    transport.go_to(13);
    transport.tick(0.0, true);
    transport.tick(0.101, true);
    assert_eq!(transport.number(), 12);
    transport.set_range(Some(-5..=99));
    assert_eq!(transport.range(), 10..=19);
    transport.step(-7);
    assert_eq!((transport.number(), transport.is_playing()), (10, false));
    transport.set_shot(0..=4, 25.0);
    assert_eq!((transport.number(), transport.range()), (4, 0..=4));
    assert!((transport.time_s() - 0.16).abs() < 1e-12);
}

/// The file that the job writes of frame `number`.
fn file_of(text: &str, folder: &std::path::Path, number: i64) -> std::path::PathBuf {
    let job = render_job::job(text, &folder.join("scene.toml"), Some(number));
    let mut render_job = render_job::RenderJob::start(job, || {}).unwrap();
    loop {
        match render_job.finished() {
            Some(result) => {
                assert_eq!(render_job.progress(), [1, 1]);
                break result.unwrap();
            }
            None => std::thread::sleep(Duration::from_millis(2)),
        }
    }
}

#[test]
fn a_still_is_the_file_that_render_writes() {
    let folder = tempfile::tempdir().unwrap();
    let before = SCENE.replace("frames = 20", "frames = 20\nfirst_frame = -9\noverscan = 6");
    for (text, number, name) in [(SCENE, 5, "scene.0005.png"), (&before, -5, "scene.-005.png")] {
        let file = file_of(text, folder.path(), number);
        assert_eq!(file, folder.path().join("out/scene").join(name));
        let full_quality = FrameRequest { full_quality: true, revision: new_revision(text), ..request(text, number) };
        let events = process(&mut engine::Engine::default(), &full_quality);
        let written = std::fs::read(&file).unwrap();
        let same = |event: &Event| matches!(event, Event::FullQualityFrame { number: own, png } if *own == number && *png == written);
        assert!(same(&events[1]), "{name}");
        let decoded = bansho::media::assets::FileAssets::new(folder.path());
        let plate = decoded.picture(&format!("out/scene/{name}"), 0).unwrap();
        let codes = plate.color.iter().map(|pixel| pixel.map(|value| (value * 255.0).round() as u8));
        assert!(codes.eq(rendered_with_alpha(&text.replace("overscan = 6", ""), number, false)), "{name}");
    }
}

#[test]
fn a_panic_while_rendering_keeps_its_message() {
    let folder = tempfile::tempdir().unwrap();
    let job = render_job::job(SCENE, &folder.path().join("scene.toml"), Some(5));
    let mut render_job = render_job::RenderJob::start(job, || panic!("broken on purpose")).unwrap();
    let ended = loop {
        match render_job.finished() {
            Some(ended) => break ended,
            None => std::thread::sleep(Duration::from_millis(2)),
        }
    };
    assert_eq!(ended, Err(render_job::JobFailure::Panicked("broken on purpose".into())));
}

#[test]
fn successive_full_quality_frames_equal_single_ones() {
    let finished = |engine: &mut engine::Engine, number: i64| {
        let events = process(engine, &FrameRequest { full_quality: true, ..request(STEPPED, number) });
        events.into_iter().find_map(|event| match event {
            Event::FullQualityFrame { number: own, png } if own == number => Some(png),
            _ => None,
        })
    };
    let mut engine = engine::Engine::default();
    for number in [3, 4, 9, 2] {
        let alone = finished(&mut engine::Engine::default(), number);
        assert!(alone.is_some() && finished(&mut engine, number) == alone, "frame {number}");
    }
}

/// Mean difference of two pictures, in codes.
fn difference(a: &Picture, b: &Picture) -> f64 {
    let codes = |picture: &Picture| -> Vec<u8> { picture.pixels.as_flattened().to_vec() };
    let sum: f64 = codes(a).iter().zip(codes(b)).map(|(a, b)| f64::from(a.abs_diff(b))).sum();
    sum / a.pixels.len() as f64
}

#[test]
fn rain_keeps_its_drops_while_its_rate_changes() {
    let text =
        |rain: &str| format!("bansho = 2\n[picture]\nsize = [160, 90]\n[sky]\nkind = \"overcast\"\n[[rain]]\n{rain}\n");
    let mut engine = engine::Engine::default();
    let mut drawn =
        |text: &str| picture(process(&mut engine, &FrameRequest { revision: new_revision(text), ..request(text, 7) }));
    let steady = drawn(&text("rate_mm_per_h = 20.0"));
    let other_drops = difference(&steady, &drawn(&text("rate_mm_per_h = 20.0").replace("size", "seed = 9\nsize")));
    assert!(other_drops > 0.1, "{other_drops}");
    let heavier = difference(&steady, &drawn(&text("rate_mm_per_h = 20.2")));
    assert!(heavier > 0.0 && heavier < 0.1 * other_drops, "{heavier} of {other_drops}");
}

#[test]
fn rain_does_not_pop_while_diameters_or_shutter_change() {
    let text = |shutter: &str, first: &str| {
        format!(
            "bansho = 2\n[picture]\nsize = [160, 90]\n[camera]\nposition = [0.0, 1.2, 4.0]\n\
             target = [0.0, 0.9, 0.0]\nshutter_s = {shutter}\n[sky]\nkind = \"overcast\"\n\
             [[rain]]\nrate_mm_per_h = 20.0\ndiameters_mm = [{first}, 2.0, 3.0]\n"
        )
    };
    let mut engine = engine::Engine::default();
    let mut drawn =
        |text: &str| picture(process(&mut engine, &FrameRequest { revision: new_revision(text), ..request(text, 7) }));
    let steady = drawn(&text("0.02", "1.0"));
    let other_drops = difference(&steady, &drawn(&text("0.02", "1.0").replace("size = [160", "seed = 9\nsize = [160")));
    assert!(other_drops > 0.1, "{other_drops}");
    for (what, changed) in [("shutter", text("0.0202", "1.0")), ("size", text("0.02", "1.005"))] {
        let off = difference(&steady, &drawn(&changed));
        assert!(off > 0.0 && off < 0.1 * other_drops, "{what}: {off} of {other_drops}");
    }
}

#[test]
fn rain_keeps_its_drops_while_the_wind_changes() {
    let text = |wind: &str| {
        let sky = "[sky]\nkind = \"overcast\"\n[wind]\ngust = 0.0\nvelocity = ";
        format!("bansho = 2\n[picture]\nsize = [160, 90]\nframes = 900\n{sky}[{wind}, 0.0, 0.0]\n[[rain]]\n")
    };
    let mut engine = engine::Engine::default();
    let mut drawn = |text: &str| {
        picture(process(&mut engine, &FrameRequest { revision: new_revision(text), ..request(text, 899) }))
    };
    let steady = drawn(&text("2.0"));
    let other_drops = difference(&steady, &drawn(&text("2.0").replace("size", "seed = 9\nsize")));
    // If the wind displaced drops from time 0 on, they would be 15 cm elsewhere after 30 s.
    let blown = difference(&steady, &drawn(&text("2.005")));
    assert!(blown > 0.0 && blown < 0.2 * other_drops, "{blown} of {other_drops}");
}

#[test]
fn a_wait_ends_with_the_picture() {
    let mut player = ThreadPlayer::start(|| {}).unwrap();
    for number in 0..20 {
        let began = std::time::Instant::now();
        player.request(request(SCENE, number));
        let mut pictures = 0;
        while player.is_busy() {
            // The picture is reported shortly before the player is idle; no wait must miss either.
            player.wait(Duration::from_secs(20));
            pictures += player.poll().iter().filter(|event| matches!(event, Event::Drawn(_))).count();
        }
        pictures += player.poll().iter().filter(|event| matches!(event, Event::Drawn(_))).count();
        assert_eq!(pictures, 1);
        assert!(began.elapsed() < Duration::from_secs(20), "a wait for nothing");
    }
}
