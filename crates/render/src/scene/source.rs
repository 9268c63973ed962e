//! The kinds of phenomena that a scene may hold, and how each is made from its table.

use std::{
    any::Any,
    sync::{Arc, Mutex, PoisonError},
};

use bansho_base::{
    host::assets::Assets,
    parameters::{Parameter, Parameters, ProblemKind, Reader, Table, TableDescriptor},
    phenomenon::Phenomenon,
};

/// What a phenomenon is made with, beside its own parameters.
#[derive(Clone, Copy)]
pub struct Opening<'a> {
    /// Its name in the scene.
    pub name: &'a str,
    /// Seed of everything random in the shot.
    pub seed: u64,
    /// Length of a seamless loop, s.
    pub loop_s: Option<f64>,
    /// Where pictures and texts come from.
    pub assets: &'a dyn Assets,
}

/// What making a phenomenon has found from its parameters alone, so that it need not be found again when the phenomenon is made for the next
/// purpose: to check it, to remark on it, to draw it.
#[derive(Default)]
pub struct Memo(Mutex<Vec<Known>>);

/// What is known for a length of the loop, as its bits.
type Known = (Option<u64>, Arc<dyn Any + Send + Sync>);

impl Memo {
    /// What is known for a loop of that length, s.
    #[must_use]
    pub fn get<T: Send + Sync + 'static>(&self, loop_s: Option<f64>) -> Option<Arc<T>> {
        let known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let own = known.iter().find(|(length, _)| *length == loop_s.map(f64::to_bits))?;
        own.1.clone().downcast().ok()
    }

    /// Keeps what is known for a loop of that length, s, instead of what was.
    pub fn keep<T: Send + Sync + 'static>(&self, loop_s: Option<f64>, value: Arc<T>) {
        let length = loop_s.map(f64::to_bits);
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        known.retain(|(other, _)| *other != length);
        known.push((length, value));
    }
}

/// A fault that only making the phenomenon shows.
#[derive(Clone, Debug, PartialEq)]
pub struct OpeningFault {
    /// The parameter at fault, with dots where it lies deeper.
    pub key: String,
    /// What is wrong.
    pub kind: ProblemKind,
}

/// A phenomenon's checked parameters.
pub trait Source: Send + Sync {
    /// Every parameter with its value, defaults too: equal tables make equal phenomena.
    fn canonical(&self) -> Table;

    /// Paths of the assets it reads, for fingerprints.
    fn assets(&self) -> Vec<String>;

    /// See [`Describe::crowd`].
    fn crowd(&self, others: i64) -> Result<i64, OpeningFault>;

    /// Makes the phenomenon.
    ///
    /// # Errors
    /// Parameters that do not go together, or an asset that cannot be had.
    fn open(&self, opening: &Opening) -> Result<Box<dyn Phenomenon>, OpeningFault>;
}

/// One kind of phenomenon, such as `flame_sheet`.
#[derive(Clone, Copy)]
pub struct PhenomenonKind {
    /// Its table's name in scene files.
    pub key: &'static str,
    /// Its parameters.
    pub table: fn() -> &'static TableDescriptor,
    /// Reads its parameters; reports faults and falls back to defaults there.
    pub read: fn(&Table, &mut Reader) -> Box<dyn Source>,
    /// Whether it is in the sky: where all is, a camera that is told nothing looks up.
    pub in_the_sky: bool,
    /// What a new scene of it states so that it is seen well, as a scene file says it; the default of a scene of it alone.
    pub setting: &'static str,
    /// Its own keys that say where it is or how large, so that the setting's camera may not fit.
    pub placement_keys: &'static [&'static str],
    /// Keys that one changes first, in tables and lists of tables within it with dots.
    pub first_keys: &'static [&'static str],
}

/// Keys that every phenomenon has beside its own.
pub const COMMON_KEYS: [&str; 2] = ["name", "enabled"];

/// Makes a [`PhenomenonKind`] from a parameter table and a constructor.
pub trait Describe: Parameter + Parameters + Clone + Send + Sync + 'static {
    /// The table's name in scene files.
    const KEY: &'static str;
    /// See [`PhenomenonKind::in_the_sky`].
    const IN_THE_SKY: bool = false;
    /// What a new scene of it states so that it is seen well, as a scene file says it; nothing where all defaults do.
    const SETTING: &'static str = "";
    /// See [`PhenomenonKind::placement_keys`].
    const PLACEMENT_KEYS: &'static [&'static str] = &[];
    /// Keys that one changes first, with which a short new scene begins; dots lead into tables and lists of tables (`burners.diameter`).
    const FIRST_KEYS: &'static [&'static str] = &[];

    /// How many particles live in memory with the `others` of the scene, of which all phenomena together may have so many.
    ///
    /// # Errors
    /// More than fit.
    fn crowd(&self, others: i64) -> Result<i64, OpeningFault> {
        Ok(others)
    }

    /// Makes the phenomenon.
    ///
    /// # Errors
    /// Parameters that do not go together, or an asset that cannot be had.
    fn open(&self, opening: &Opening) -> Result<Box<dyn Phenomenon>, OpeningFault>;

    /// Makes the phenomenon where the same parameters may have been opened before, with what `memo` knows from then.
    ///
    /// # Errors
    /// Those of [`open`](Self::open).
    fn open_again(&self, opening: &Opening, _memo: &Memo) -> Result<Box<dyn Phenomenon>, OpeningFault> {
        self.open(opening)
    }

    /// The kind that scene files call by [`KEY`](Self::KEY).
    const KIND: PhenomenonKind = PhenomenonKind {
        key: Self::KEY,
        table: <Self as Parameters>::table,
        read: read_described::<Self>,
        in_the_sky: Self::IN_THE_SKY,
        setting: Self::SETTING,
        placement_keys: Self::PLACEMENT_KEYS,
        first_keys: Self::FIRST_KEYS,
    };
}

fn read_described<P: Describe>(table: &Table, reader: &mut Reader) -> Box<dyn Source> {
    Box::new(Described(P::read_table(table, reader, &COMMON_KEYS), Memo::default()))
}

struct Described<P>(P, Memo);

impl<P: Describe> Source for Described<P> {
    fn canonical(&self) -> Table {
        self.0.to_table()
    }

    fn assets(&self) -> Vec<String> {
        bansho_base::parameters::assets(&self.0.to_table(), P::table())
    }

    fn crowd(&self, others: i64) -> Result<i64, OpeningFault> {
        self.0.crowd(others)
    }

    fn open(&self, opening: &Opening) -> Result<Box<dyn Phenomenon>, OpeningFault> {
        let Some(seconds) = opening.loop_s else { return self.0.open_again(opening, &self.1) };
        let mut repeating = self.0.clone();
        match repeating.close_loop(seconds) {
            Some(key) => Err(OpeningFault { key, kind: ProblemKind::LoopJumps { seconds } }),
            None => repeating.open_again(opening, &self.1),
        }
    }
}
