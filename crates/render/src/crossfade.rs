//! Seamless loops of what is stepped: the end of one run dissolves into the beginning of the next.

use bansho_base::{
    geometry::point_cloud::PointCloud,
    host::observer::{Cancelled, Observer},
    image::{Image, MetadataEntry, Rect},
    phenomenon::{
        Deflection, Prepared, Run, SnapshotError, Stepped, Stepping,
        strip::{AovDescriptor, DepthInterval, Shutter, Strip, View},
        surroundings::{Publication, Surroundings},
    },
};

/// A stepped phenomenon in a loop: two runs of it, mixed about the moment where the loop closes.
///
/// Every turn has a run of its own, all runs are the same, and each outlasts its turn by half a dissolve on both sides. So at time
/// t of a turn one run stands at t, and another at t + turn, on its way out, or at t - turn, on its way in. Where a turn
/// ends both count alike and change places, so that no picture jumps, and two that differ move less than one.
pub(crate) struct CrossfadeRun {
    turn: f64,
    stepping: Stepping,
    aovs: &'static [AovDescriptor],
    /// The run of this turn.
    present: SegmentRun,
    /// That of the last turn in the first half of this one, then that of the next.
    passing: SegmentRun,
    /// Whether `passing` is on its way in.
    comes: bool,
    /// State of every run where its dissolve begins.
    beginning: Vec<u8>,
}

/// A run, and the steps it has taken.
struct SegmentRun {
    run: Box<dyn Run>,
    taken: u64,
}

impl SegmentRun {
    fn step(&mut self, stepping: Stepping, surroundings: &Surroundings) {
        if let Some(stepped) = self.run.as_stepped_mut() {
            stepped.step(stepping.time_after(self.taken), surroundings);
        }
        self.taken += 1;
    }

    fn advance(&mut self, taken: u64, stepping: Stepping, surroundings: &Surroundings) {
        while self.taken < taken {
            self.step(stepping, surroundings);
        }
    }

    /// Goes to a state, which another run of the same phenomenon gave.
    fn go_to(&mut self, state: &[u8], taken: u64) -> Result<(), SnapshotError> {
        self.run.as_stepped_mut().ok_or(SnapshotError::NoState)?.restore(state)?;
        self.taken = taken;
        Ok(())
    }

    fn snapshot(&self) -> Vec<u8> {
        self.run.as_stepped().map(|stepped| stepped.snapshot()).unwrap_or_default()
    }
}

impl CrossfadeRun {
    /// A loop of `turn` seconds of what steps as said, of which two runs are given at their beginning.
    pub(crate) fn new(turn: f64, stepping: Stepping, aovs: &'static [AovDescriptor], runs: [Box<dyn Run>; 2]) -> Self {
        let [present, passing] = runs.map(|run| SegmentRun { run, taken: 0 });
        Self { beginning: present.snapshot(), turn, stepping, aovs, present, passing, comes: false }
    }

    /// How it steps: every run goes on for half a crossfade beyond its turn.
    pub(crate) fn stepping(&self) -> Stepping {
        Stepping { preroll: self.stepping.preroll + self.turn, ..self.stepping }
    }

    /// Steps after which runs begin to come in.
    fn begun(&self) -> u64 {
        self.stepping.steps_until(-0.5 * self.stepping.crossfade)
    }

    /// The run before the first turn: leaves its state where later ones begin, and where the first turn's does.
    fn run_up(&mut self, until: u64, surroundings: &Surroundings) -> Result<(), SnapshotError> {
        let (begun, first) = (self.begun(), self.stepping.steps_until(0.0));
        while self.passing.taken < until {
            self.passing.step(self.stepping, surroundings);
            if self.passing.taken == begun {
                self.beginning = self.passing.snapshot();
            }
            if self.passing.taken == first {
                self.present.go_to(&self.passing.snapshot(), first)?;
            }
        }
        Ok(())
    }

    /// Brings both runs to time `t` of the turn; before 0 only the one that then leaves.
    fn go_on(&mut self, t: f64, surroundings: &Surroundings) -> Result<(), SnapshotError> {
        let stepping = self.stepping;
        if t < 0.5 * stepping.step {
            return self.run_up(stepping.steps_until(t + self.turn), surroundings);
        }
        self.present.advance(stepping.steps_until(t), stepping, surroundings);
        if t >= 0.5 * self.turn {
            if !self.comes {
                self.passing.go_to(&self.beginning, self.begun())?;
                self.comes = true;
            }
            self.passing.advance(stepping.steps_until(t - self.turn), stepping, surroundings);
        } else if t <= 0.5 * stepping.crossfade {
            self.passing.advance(stepping.steps_until(t + self.turn), stepping, surroundings);
        }
        Ok(())
    }

    /// How much the present run counts at time `t` of the turn, in [1/2, 1].
    fn share(&self, t: f64) -> f32 {
        // States lag behind by up to two steps.
        let half = 0.5 * self.stepping.crossfade - 2.0 * self.stepping.step;
        let way = t.min(self.turn - t);
        if way < half { (0.5 + 0.5 * way / half).max(0.5) as f32 } else { 1.0 }
    }
}

impl Run for CrossfadeRun {
    fn publish(&self, shutter: Shutter) -> Publication {
        let share = self.share(shutter.middle());
        let present = self.present.run.publish(shutter);
        if share == 1.0 {
            return present;
        }
        let by = if shutter.middle() < 0.5 * self.turn { self.turn } else { -self.turn };
        let other = Shutter { open: shutter.open + by, close: shutter.close + by };
        let mut both = shared(present, share);
        both.extend(&shared(self.passing.run.publish(other), 1.0 - share));
        both
    }

    fn depth_intervals(&self, view: &View, surroundings: &Surroundings) -> Vec<DepthInterval> {
        let mut intervals = self.present.run.depth_intervals(view, surroundings);
        if let Some(other) = self.other_view(view) {
            intervals.extend(self.passing.run.depth_intervals(other, surroundings));
        }
        intervals
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        let present = self.present.run.prepare(view, surroundings, observer)?;
        let Some(other) = self.other_view(view) else { return Ok(present) };
        let passing = self.passing.run.prepare(other, surroundings, observer)?;
        let share = self.share(view.shutter.middle());
        Ok(Box::new(Mixed { bend: Bend::new(&*present, &*passing, share), aovs: self.aovs, present, passing, share }))
    }

    fn export(&self, t: f64) -> Option<PointCloud> {
        self.present.run.export(t)
    }

    fn as_stepped(&self) -> Option<&dyn Stepped> {
        Some(self)
    }

    fn as_stepped_mut(&mut self) -> Option<&mut dyn Stepped> {
        Some(self)
    }
}

impl Stepped for CrossfadeRun {
    fn step(&mut self, time: f64, surroundings: &Surroundings) {
        let done = self.go_on(time + self.stepping.step, surroundings);
        debug_assert_eq!(done, Ok(()), "runs of one phenomenon take up each other's states");
    }

    fn snapshot(&self) -> Vec<u8> {
        let (present, passing) = (self.present.snapshot(), self.passing.snapshot());
        let mut bytes = vec![u8::from(self.comes)];
        bytes.extend([self.present.taken, self.passing.taken].into_iter().flat_map(u64::to_le_bytes));
        for state in [&present, &passing, &self.beginning] {
            bytes.extend((state.len() as u64).to_le_bytes());
            bytes.extend(state);
        }
        bytes
    }

    fn restore(&mut self, state: &[u8]) -> Result<(), SnapshotError> {
        let saved = Saved::read(state).ok_or(SnapshotError::Damaged)?;
        let before = (self.present.snapshot(), self.present.taken);
        self.present.go_to(saved.present, saved.taken[0])?;
        if let Err(error) = self.passing.go_to(saved.passing, saved.taken[1]) {
            self.present.go_to(&before.0, before.1)?;
            return Err(error);
        }
        (self.comes, self.beginning) = (saved.comes, saved.beginning.to_vec());
        Ok(())
    }
}

impl CrossfadeRun {
    /// The view that the passing run is seen in, where it counts.
    fn other_view<'a>(&self, view: &'a View) -> Option<&'a View> {
        view.adjacent_loop_view.as_deref().filter(|_| self.share(view.shutter.middle()) < 1.0)
    }
}

/// What counts `share` of what is published.
fn shared(mut publication: Publication, share: f32) -> Publication {
    publication.lights.iter_mut().for_each(|light| light.intensity = light.intensity.map(|value| value * share));
    publication.extinction *= f64::from(share);
    publication
}

/// A snapshot's parts.
struct Saved<'a> {
    comes: bool,
    taken: [u64; 2],
    present: &'a [u8],
    passing: &'a [u8],
    beginning: &'a [u8],
}

impl<'a> Saved<'a> {
    fn read(bytes: &'a [u8]) -> Option<Self> {
        let (comes, rest) = bytes.split_first()?;
        let (present_taken, rest) = word(rest)?;
        let (passing_taken, rest) = word(rest)?;
        let (present, rest) = state(rest)?;
        let (passing, rest) = state(rest)?;
        let (beginning, rest) = state(rest)?;
        let taken = [present_taken, passing_taken];
        rest.is_empty().then_some(Self { comes: *comes == 1, taken, present, passing, beginning })
    }
}

fn word(bytes: &[u8]) -> Option<(u64, &[u8])> {
    bytes.split_first_chunk().map(|(word, rest)| (u64::from_le_bytes(*word), rest))
}

fn state(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = word(bytes)?;
    rest.split_at_checked(usize::try_from(length).ok()?)
}

/// One frame of two runs.
struct Mixed<'a> {
    present: Box<dyn Prepared + 'a>,
    passing: Box<dyn Prepared + 'a>,
    share: f32,
    aovs: &'static [AovDescriptor],
    bend: Option<Bend>,
}

impl Prepared for Mixed<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        self.present.bounds(slice).union(&self.passing.bounds(slice))
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let mut other = strip.empty_like();
        self.present.draw(slice, strip);
        self.passing.draw(slice, &mut other);
        strip.crossfade(other, self.share, self.aovs);
    }

    fn metadata(&self) -> Vec<MetadataEntry> {
        let mix = |(present, passing): (MetadataEntry, MetadataEntry)| {
            let value = f64::from(self.share).mul_add(present.value - passing.value, passing.value);
            MetadataEntry { value, ..present }
        };
        self.present.metadata().into_iter().zip(self.passing.metadata()).map(mix).collect()
    }

    fn may_bend(&self) -> bool {
        self.present.may_bend() || self.passing.may_bend()
    }

    fn deflection(&self) -> Option<Deflection<'_>> {
        self.bend.as_ref().map(|bend| Deflection { depth: bend.depth, rect: bend.rect, angle: &bend.angle })
    }
}

/// The angles of two runs together.
struct Bend {
    depth: f64,
    rect: Rect,
    angle: Image<2>,
}

impl Bend {
    fn new(present: &dyn Prepared, passing: &dyn Prepared, share: f32) -> Option<Self> {
        let parts = [(present.deflection(), share), (passing.deflection(), 1.0 - share)];
        let parts: Vec<_> = parts.into_iter().filter_map(|(part, share)| Some((part?, share))).collect();
        let depth = parts.iter().map(|(part, _)| part.depth).reduce(f64::min)?;
        let rect = parts.iter().fold(Rect::default(), |all, (part, _)| all.union(&part.rect));
        let mut angle = Image::filled(rect.width, rect.height, [0.0; 2]);
        for (part, share) in &parts {
            for y in 0..part.rect.height {
                let row = &mut angle.row_mut(part.rect.y - rect.y + y)[part.rect.x - rect.x..][..part.rect.width];
                row.iter_mut()
                    .zip(part.angle.row(y))
                    .for_each(|(sum, own)| *sum = [0, 1].map(|i| own[i].mul_add(*share, sum[i])));
            }
        }
        Some(Self { depth, rect, angle })
    }
}
