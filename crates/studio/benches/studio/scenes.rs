//! The scenes that are measured, and their edits.

use bansho::{
    base::parameters::Value,
    scene::{ValuePath, operation::Operation},
};
use bansho_studio::app::Session;

use crate::Error;

/// Size of the preview, pixels.
pub(crate) const PICTURE: [usize; 2] = [960, 540];

/// Number of edits; the second slowest latency is the 95th percentile.
pub(crate) const EDITS: usize = 20;

/// A benchmark scene, and the parameter that is edited.
pub(crate) struct BenchScene {
    pub(crate) name: &'static str,
    text: &'static str,
    /// The number that is edited; without one, a stroke of an aurora is edited.
    number: Option<EditedNumber>,
}

/// A parameter of the first phenomenon of a kind, edited in steps.
struct EditedNumber {
    kind: &'static str,
    keys: &'static [&'static str],
    /// The value at the first step, and that after the last.
    range: [f64; 2],
}

pub(crate) static BENCH_SCENES: [BenchScene; 4] = [
    BenchScene {
        name: "flame sheet",
        text: "[[flame_sheet]]\n",
        number: Some(EditedNumber { kind: "flame_sheet", keys: &["height"], range: [0.8, 1.0] }),
    },
    BenchScene {
        name: "particle flame of 3,000",
        text: "[[flame_particles]]\nparticles = 3000\n",
        number: Some(EditedNumber { kind: "flame_particles", keys: &["forces", "buoyancy"], range: [1.0, 1.4] }),
    },
    BenchScene {
        name: "rain at 20 mm/h",
        text: "[sky]\nkind = \"overcast\"\n[[rain]]\nrate_mm_per_h = 20.0\n",
        number: Some(EditedNumber { kind: "rain", keys: &["rate_mm_per_h"], range: [20.0, 24.0] }),
    },
    BenchScene {
        name: "aurora of 30,000",
        text: "[camera]\nposition = [0.0, 1.7, 0.0]\ntarget = [0.0, 30.0, -60.0]\nvertical_fov_deg = 62.0\n\
               [[aurora]]\nparticles = { count = 30000 }\n\
               [[aurora.shapes]]\nsheets = [{ points = [[-240.0, -180.0], [0.0, -150.0], [240.0, -180.0]] }]\n",
        number: None,
    },
];

impl BenchScene {
    /// The text of the scene.
    pub(crate) fn text(&self) -> String {
        let [width, height] = PICTURE;
        format!("bansho = 2\n[picture]\nsize = [{width}, {height}]\nframes = 240\n{}", self.text)
    }

    /// Whether the scene has the aurora's editor open below its picture.
    pub(crate) fn has_editor(&self) -> bool {
        self.number.is_none()
    }

    /// Edits the scene as a drag does that has reached `step` of [`EDITS`].
    ///
    /// # Errors
    /// The stroke of an aurora is invalid.
    pub(crate) fn edit(&self, session: &mut Session, step: usize) -> Result<(), Error> {
        let progress = step as f64 / EDITS as f64;
        let Some(EditedNumber { kind, keys, range: [from, to] }) = self.number else {
            let points = [[-240.0, -180.0], [0.0, -150.0 - 60.0 * progress], [240.0, -180.0]]
                .map(|point| Value::numbers(point).into());
            let sheets = ValuePath::root().key("aurora").index(0).key("shapes").index(0).key("sheets");
            let path = sheets.index(0).key("points");
            let stroke = Operation::Set { path, value: Value::List(points.into()) };
            let assets = session.assets().clone();
            session.document.edit_shapes("move point", &[stroke], 0, &assets)?;
            return Ok(());
        };
        let path = keys.iter().fold(ValuePath::root().key(kind).index(0), |path, key| path.key(key));
        session.set("slider", &path, Value::Number(from + (to - from) * progress));
        Ok(())
    }

    /// # Errors
    /// The scene is invalid, or cannot be drawn: what the studio shows then.
    pub(crate) fn check(&self, session: &Session) -> Result<(), Error> {
        let fault = session.document.error().map(ToString::to_string);
        match fault.or_else(|| session.notice().map(str::to_owned)) {
            Some(reason) => Err(format!("{}: {reason}", self.name).into()),
            None => Ok(()),
        }
    }
}

/// The second largest latency.
pub(crate) fn percentile_95(mut latencies: Vec<f64>) -> f64 {
    latencies.sort_by(f64::total_cmp);
    latencies.into_iter().rev().nth(1).unwrap_or_default()
}
