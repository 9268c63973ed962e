//! How fast the studio follows: pictures a second of each phenomenon while it plays, and how long after a change its
//! picture is there.

use std::{sync::Arc, thread, time::Duration};

use bansho::Assets;
use web_time::Instant;

use crate::{
    document::Document,
    examples::Bundle,
    player::{Event, Picture, Player, StartError, ThreadPlayer, Wish},
};

/// What the preview is measured at, pixels.
const SIZE: [usize; 2] = [960, 540];

/// Pictures that are played.
const PLAYED: i64 = 60;

/// Each phenomenon, as the studio promises to follow it.
const SCENES: [(&str, &str); 4] = [
    ("flame sheet", "[[flame_sheet]]\n"),
    ("particle flame of 3,000", "[[flame_particles]]\nparticles = 3000\n"),
    ("rain at 20 mm/h", "[sky]\nkind = \"overcast\"\n[[rain]]\nrate_mm_per_h = 20.0\n"),
    (
        "aurora of 30,000",
        "[camera]\nposition = [0.0, 1.7, 0.0]\ntarget = [0.0, 30.0, -60.0]\nvertical_fov_deg = 62.0\n\
         [[aurora]]\nparticles = { count = 30000 }\n",
    ),
];

/// How fast one scene goes.
#[derive(Clone, Debug, PartialEq)]
pub struct Speed {
    /// The phenomenon.
    pub name: &'static str,
    /// Pictures a second while it plays.
    pub pictures_per_s: f64,
    /// What of each the simulation takes, s.
    pub advance_s: f64,
    /// What of each drawing takes, s. The rest is the studio's own.
    pub draw_s: f64,
    /// From a change to its picture, s.
    pub answer_s: f64,
}

/// Measures those whose name contains `wanted`, each when it is asked for.
///
/// # Errors
/// The system gives no threads, or a scene cannot be drawn.
pub fn measure(wanted: &str) -> impl Iterator<Item = Result<Speed, BenchError>> {
    let scenes = SCENES.into_iter().filter(move |(name, _)| name.contains(wanted));
    scenes.map(|(name, text)| speed(name, text))
}

/// Why nothing can be measured.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// No player.
    #[error(transparent)]
    Start(#[from] StartError),
    /// A picture that did not come.
    #[error("{scene}: {reason}")]
    Picture {
        /// Which scene.
        scene: &'static str,
        /// What the player said.
        reason: String,
    },
}

fn speed(name: &'static str, text: &str) -> Result<Speed, BenchError> {
    let [width, height] = SIZE;
    let text = format!("bansho = 1\n[picture]\nsize = [{width}, {height}]\nframes = 240\n{text}");
    let mut document = Document::new(name, text);
    let mut player = ThreadPlayer::start(|| {})?;
    // The same all the while: others would be read anew.
    let assets: Arc<dyn Assets> = Arc::new(Bundle::default());
    let mut draw = |document: &Document, number: i64| drawn(&mut player, document, &assets, name, number);
    // The first picture makes what is made once.
    draw(&document, 0)?;
    let began = Instant::now();
    let (mut advance_s, mut draw_s) = (0.0, 0.0);
    for number in 1..=PLAYED {
        let picture = draw(&document, number)?;
        advance_s += picture.advance_s / PLAYED as f64;
        draw_s += picture.draw_s / PLAYED as f64;
    }
    let pictures_per_s = PLAYED as f64 / began.elapsed().as_secs_f64();
    let began = Instant::now();
    document.replace("wind", &format!("{}[wind]\nvelocity = [1.0, 0.0, 0.0]\n", document.text()));
    draw(&document, PLAYED)?;
    Ok(Speed { name, pictures_per_s, advance_s, draw_s, answer_s: began.elapsed().as_secs_f64() })
}

fn drawn(
    player: &mut ThreadPlayer,
    document: &Document,
    assets: &Arc<dyn Assets>,
    scene: &'static str,
    number: i64,
) -> Result<Picture, BenchError> {
    player.wish(Wish {
        revision: document.revision(),
        name: document.name().to_owned(),
        text: document.text().clone(),
        assets: assets.clone(),
        number: Some(number),
        within: SIZE,
        exact: false,
        draft: false,
        still: false,
        stages: None,
    });
    let failed = |reason: String| BenchError::Picture { scene, reason };
    loop {
        for event in player.poll() {
            match event {
                Event::Drawn(picture) => return Ok(picture),
                Event::Judged { outcome: Err(error), .. } => return Err(failed(error.to_string())),
                Event::Failed { reason, .. } => return Err(failed(reason)),
                Event::Panicked { message, .. } => return Err(failed(message)),
                Event::Judged { .. } | Event::Stage(..) | Event::Still { .. } => {}
            }
        }
        thread::sleep(Duration::from_micros(200));
    }
}
