//! How large a picture may be to keep up: whole where the machine is fast, smaller where it is not.

/// Shares of the window's size that a preview may have, the largest first.
const SHARES: [f64; 7] = [1.0, 0.75, 0.5, 0.375, 0.25, 0.1875, 0.125];

/// Chooses how large previews are, by how long they take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pace {
    step: usize,
}

impl Pace {
    /// The share of the window's sides that the next preview should have.
    pub fn share(&self) -> f64 {
        SHARES[self.step]
    }

    /// Learns that a preview of the present size took `draw_s` where `target_s` is wanted, s.
    pub fn learn(&mut self, draw_s: f64, target_s: f64) {
        /// A larger picture must fit with room to spare, so that sizes do not flicker.
        const ROOM: f64 = 0.7;
        if draw_s > target_s {
            self.step = (self.step + 1..SHARES.len())
                .find(|&step| self.predicted(draw_s, step) <= target_s)
                .unwrap_or(SHARES.len() - 1);
        } else if self.step > 0 && self.predicted(draw_s, self.step - 1) <= ROOM * target_s {
            self.step -= 1;
        }
    }

    /// Time goes with the number of pixels.
    fn predicted(&self, draw_s: f64, step: usize) -> f64 {
        let ratio = SHARES[step] / self.share();
        draw_s * ratio * ratio
    }
}
