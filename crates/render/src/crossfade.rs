//! Seamless loops of stepped phenomena: the end of one run is crossfaded into the beginning of the next.

use bansho_base::{
    frame::MetadataEntry,
    geometry::point_cloud::PointCloud,
    host::observer::{Cancelled, Observer},
    image::{Image, Rect},
    phenomenon::{
        Deflection, PlateRole, Prepared, Run, SnapshotError, Stepped, Stepping,
        strip::{AovDescriptor, DepthInterval, Shutter, Strip, View},
        surroundings::{Publication, Surroundings},
    },
};

/// A stepped phenomenon in a loop: two runs of it, crossfaded around the moment at which the loop closes.
///
/// Each period has its own run, all runs are equal, and each exceeds its period by half a crossfade on both sides. At time t of a period,
/// the current run is at t, and the adjacent run at t + period (the previous one, fading out) or at t - period (the next one, fading in).
/// Where a period ends, both have the weight 1/2 and exchange their roles, so that the picture does not jump. The mean of two runs also
/// changes less from frame to frame than a single run.
pub(crate) struct CrossfadeRun {
    /// Length of the loop, s.
    period: f64,
    stepping: Stepping,
    aovs: &'static [AovDescriptor],
    /// The run of this period.
    current: SegmentRun,
    /// The run of the previous period in the first half of this one, then that of the next period.
    adjacent: SegmentRun,
    /// Whether `adjacent` is the run of the next period.
    adjacent_is_next: bool,
    /// State of every run at the beginning of its crossfade.
    crossfade_start: Vec<u8>,
}

/// A run, and the number of steps that it has taken.
struct SegmentRun {
    run: Box<dyn Run>,
    steps_taken: u64,
}

impl SegmentRun {
    fn step(&mut self, stepping: Stepping, surroundings: &Surroundings) {
        if let Some(stepped) = self.run.as_stepped_mut() {
            stepped.step(stepping.time_after(self.steps_taken), surroundings);
        }
        self.steps_taken += 1;
    }

    fn advance(&mut self, steps: u64, stepping: Stepping, surroundings: &Surroundings) {
        while self.steps_taken < steps {
            self.step(stepping, surroundings);
        }
    }

    /// Restores a state of another run of the same phenomenon.
    fn restore(&mut self, state: &[u8], steps_taken: u64) -> Result<(), SnapshotError> {
        self.run.as_stepped_mut().ok_or(SnapshotError::NoState)?.restore(state)?;
        self.steps_taken = steps_taken;
        Ok(())
    }

    fn snapshot(&self) -> Vec<u8> {
        self.run.as_stepped().map(|stepped| stepped.snapshot()).unwrap_or_default()
    }
}

impl CrossfadeRun {
    /// A loop of `period` seconds from two runs in their initial states, which step as `stepping` says.
    pub(crate) fn new(
        period: f64,
        stepping: Stepping,
        aovs: &'static [AovDescriptor],
        runs: [Box<dyn Run>; 2],
    ) -> Self {
        let [current, adjacent] = runs.map(|run| SegmentRun { run, steps_taken: 0 });
        let crossfade_start = current.snapshot();
        Self { period, stepping, aovs, current, adjacent, adjacent_is_next: false, crossfade_start }
    }

    /// How the loop steps: the preroll includes the run of the period before time 0.
    pub(crate) fn stepping(&self) -> Stepping {
        Stepping { preroll: self.stepping.preroll + self.period, ..self.stepping }
    }

    /// Number of steps after which a run begins to fade in.
    fn steps_before_fade_in(&self) -> u64 {
        self.stepping.steps_until(-0.5 * self.stepping.crossfade)
    }

    /// Steps the run before the first period to `steps`. On the way its state is kept for the later runs, which begin from there, and given to
    /// the run of the first period.
    fn step_first_run(&mut self, steps: u64, surroundings: &Surroundings) -> Result<(), SnapshotError> {
        let (fade_in, first) = (self.steps_before_fade_in(), self.stepping.steps_until(0.0));
        while self.adjacent.steps_taken < steps {
            self.adjacent.step(self.stepping, surroundings);
            if self.adjacent.steps_taken == fade_in {
                self.crossfade_start = self.adjacent.snapshot();
            }
            if self.adjacent.steps_taken == first {
                self.current.restore(&self.adjacent.snapshot(), first)?;
            }
        }
        Ok(())
    }

    /// Steps both runs to time `t` of the period. Before time 0 there is only the run that later fades out.
    fn advance_to(&mut self, t: f64, surroundings: &Surroundings) -> Result<(), SnapshotError> {
        let stepping = self.stepping;
        if t < 0.5 * stepping.step {
            return self.step_first_run(stepping.steps_until(t + self.period), surroundings);
        }
        self.current.advance(stepping.steps_until(t), stepping, surroundings);
        if t >= 0.5 * self.period {
            if !self.adjacent_is_next {
                self.adjacent.restore(&self.crossfade_start, self.steps_before_fade_in())?;
                self.adjacent_is_next = true;
            }
            self.adjacent.advance(stepping.steps_until(t - self.period), stepping, surroundings);
        } else if t <= 0.5 * stepping.crossfade {
            self.adjacent.advance(stepping.steps_until(t + self.period), stepping, surroundings);
        }
        Ok(())
    }

    /// Weight of the current run at time `t` of the period, 1/2 to 1.
    fn current_weight(&self, t: f64) -> f32 {
        // States are up to two steps behind the time.
        let half = 0.5 * self.stepping.crossfade - 2.0 * self.stepping.step;
        let distance = t.min(self.period - t);
        if distance < half { (0.5 + 0.5 * distance / half).max(0.5) as f32 } else { 1.0 }
    }
}

impl Run for CrossfadeRun {
    fn publish(&self, shutter: Shutter) -> Publication {
        let weight = self.current_weight(shutter.middle());
        let current = self.current.run.publish(shutter);
        if weight == 1.0 {
            return current;
        }
        let mut both = scaled(current, weight);
        both.extend(&scaled(self.adjacent.run.publish(self.adjacent_shutter(shutter)), 1.0 - weight));
        both
    }

    fn depth_intervals(&self, view: &View, surroundings: &Surroundings) -> Vec<DepthInterval> {
        let mut intervals = self.current.run.depth_intervals(view, surroundings);
        if let Some(adjacent_view) = self.adjacent_view(view) {
            intervals.extend(self.adjacent.run.depth_intervals(adjacent_view, surroundings));
        }
        intervals
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        let current = self.current.run.prepare(view, surroundings, observer)?;
        let Some(adjacent_view) = self.adjacent_view(view) else { return Ok(current) };
        let adjacent = self.adjacent.run.prepare(adjacent_view, surroundings, observer)?;
        let weight = self.current_weight(view.shutter.middle());
        let deflection = MixedDeflection::new(&*current, &*adjacent, weight);
        Ok(Box::new(PreparedCrossfade { deflection, aovs: self.aovs, current, adjacent, current_weight: weight }))
    }

    fn export_particles(&self, view: &View, surroundings: &Surroundings) -> Option<PointCloud> {
        self.current.run.export_particles(view, surroundings)
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
        let done = self.advance_to(time + self.stepping.step, surroundings);
        debug_assert_eq!(done, Ok(()), "a run restores the states of other runs of its phenomenon");
    }

    /// The later of the time that its run wants and the middle of the exposure, at which both runs are drawn.
    fn time_for(&self, shutter: Shutter) -> f64 {
        self.current.run.as_stepped().map_or(0.0, |run| run.time_for(shutter)).max(shutter.middle())
    }

    fn begin_exposure(&mut self, shutter: Shutter) {
        let adjacent_shutter = self.adjacent_shutter(shutter);
        for (segment, shutter) in [(&mut self.current, shutter), (&mut self.adjacent, adjacent_shutter)] {
            if let Some(stepped) = segment.run.as_stepped_mut() {
                stepped.begin_exposure(shutter);
            }
        }
    }

    /// As its current run, which has no states before the loop begins.
    fn keeps_states_for(&self, shutter: Shutter) -> bool {
        shutter.open < 0.0 || self.current.run.as_stepped().is_none_or(|run| run.keeps_states_for(shutter))
    }

    fn snapshot(&self) -> Vec<u8> {
        let (current, adjacent) = (self.current.snapshot(), self.adjacent.snapshot());
        let mut bytes = vec![u8::from(self.adjacent_is_next)];
        bytes.extend([self.current.steps_taken, self.adjacent.steps_taken].into_iter().flat_map(u64::to_le_bytes));
        for state in [&current, &adjacent, &self.crossfade_start] {
            bytes.extend((state.len() as u64).to_le_bytes());
            bytes.extend(state);
        }
        bytes
    }

    fn restore(&mut self, state: &[u8]) -> Result<(), SnapshotError> {
        let saved = CrossfadeSnapshot::read(state).ok_or(SnapshotError::Damaged)?;
        let (state_before, steps_before) = (self.current.snapshot(), self.current.steps_taken);
        self.current.restore(saved.current, saved.current_steps)?;
        if let Err(error) = self.adjacent.restore(saved.adjacent, saved.adjacent_steps) {
            self.current.restore(&state_before, steps_before)?;
            return Err(error);
        }
        self.adjacent_is_next = saved.adjacent_is_next;
        self.crossfade_start = saved.crossfade_start.to_vec();
        Ok(())
    }
}

impl CrossfadeRun {
    /// An exposure in the time of the adjacent run.
    fn adjacent_shutter(&self, shutter: Shutter) -> Shutter {
        let offset = if shutter.middle() < 0.5 * self.period { self.period } else { -self.period };
        Shutter { open: shutter.open + offset, close: shutter.close + offset }
    }

    /// The view of the adjacent run; `None` where its weight is 0.
    fn adjacent_view<'a>(&self, view: &'a View) -> Option<&'a View> {
        view.adjacent_loop_view.as_deref().filter(|_| self.current_weight(view.shutter.middle()) < 1.0)
    }
}

/// What is published, scaled by the weight of its run.
fn scaled(mut publication: Publication, weight: f32) -> Publication {
    let lights = publication.lights.iter_mut().chain(&mut publication.sky_lights);
    lights.for_each(|light| light.intensity = light.intensity.map(|value| value * weight));
    publication.extinction *= f64::from(weight);
    publication
}

/// The contents of a snapshot.
struct CrossfadeSnapshot<'a> {
    adjacent_is_next: bool,
    current_steps: u64,
    adjacent_steps: u64,
    current: &'a [u8],
    adjacent: &'a [u8],
    crossfade_start: &'a [u8],
}

impl<'a> CrossfadeSnapshot<'a> {
    fn read(bytes: &'a [u8]) -> Option<Self> {
        let (adjacent_is_next, rest) = bytes.split_first()?;
        let adjacent_is_next = *adjacent_is_next == 1;
        let (current_steps, rest) = word(rest)?;
        let (adjacent_steps, rest) = word(rest)?;
        let (current, rest) = state(rest)?;
        let (adjacent, rest) = state(rest)?;
        let (crossfade_start, rest) = state(rest)?;
        let snapshot = Self { adjacent_is_next, current_steps, adjacent_steps, current, adjacent, crossfade_start };
        rest.is_empty().then_some(snapshot)
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
struct PreparedCrossfade<'a> {
    current: Box<dyn Prepared + 'a>,
    adjacent: Box<dyn Prepared + 'a>,
    current_weight: f32,
    aovs: &'static [AovDescriptor],
    deflection: Option<MixedDeflection>,
}

impl Prepared for PreparedCrossfade<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        self.current.bounds(slice).union(&self.adjacent.bounds(slice))
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let mut adjacent = strip.empty_like();
        self.current.draw(slice, strip);
        self.adjacent.draw(slice, &mut adjacent);
        strip.crossfade(adjacent, self.current_weight, self.aovs);
    }

    fn metadata(&self) -> Vec<MetadataEntry> {
        let mut entries = self.current.metadata();
        let adjacent_entries = self.adjacent.metadata();
        entries.truncate(adjacent_entries.len());
        for (entry, adjacent) in entries.iter_mut().zip(adjacent_entries) {
            entry.value = f64::from(self.current_weight).mul_add(entry.value - adjacent.value, adjacent.value);
        }
        entries
    }

    fn may_refract(&self) -> bool {
        self.current.may_refract() || self.adjacent.may_refract()
    }

    fn plate_role(&self) -> PlateRole {
        self.current.plate_role()
    }

    fn deflection(&self) -> Option<Deflection<'_>> {
        let mixed = self.deflection.as_ref()?;
        Some(Deflection { depth: mixed.depth, rect: mixed.rect, angle: &mixed.angle })
    }
}

/// The weighted mean of the deflections of two runs, at the smaller of their depths.
struct MixedDeflection {
    depth: f64,
    rect: Rect,
    angle: Image<2>,
}

impl MixedDeflection {
    fn new(current: &dyn Prepared, adjacent: &dyn Prepared, current_weight: f32) -> Option<Self> {
        let weighted = [(current.deflection(), current_weight), (adjacent.deflection(), 1.0 - current_weight)];
        let weighted: Vec<_> =
            weighted.into_iter().filter_map(|(deflection, weight)| Some((deflection?, weight))).collect();
        let depth = weighted.iter().map(|(deflection, _)| deflection.depth).reduce(f64::min)?;
        let rect = weighted.iter().fold(Rect::default(), |all, (deflection, _)| all.union(&deflection.rect));
        let mut angle = Image::filled(rect.width, rect.height, [0.0; 2]);
        for (Deflection { rect: own, angle: own_angle, .. }, weight) in &weighted {
            for y in 0..own.height {
                let row = &mut angle.row_mut(own.y - rect.y + y)[own.x - rect.x..][..own.width];
                row.iter_mut()
                    .zip(own_angle.row(y))
                    .for_each(|(sum, own)| *sum = [0, 1].map(|i| own[i].mul_add(*weight, sum[i])));
            }
        }
        Some(Self { depth, rect, angle })
    }
}
