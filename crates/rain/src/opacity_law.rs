//! The choice of the law of the opacity of streaks; `streaks::coverage` has the laws themselves.

bansho_base::choice! {
    /// Law of the opacity of streaks.
    pub enum OpacityLaw {
        /// Fraction of the exposure during which the drop covers a point.
        ExposureFraction = "exposure_fraction",
        /// 2 D / v as Yoshida, Dobashi & Yamamoto print it, with D in mm and v in m/s: 67 times as much on the axis in 1/30 s, and the same for any exposure.
        Paper = "paper",
    }
}
