//! Values at evenly spaced nodes along a sheet, one at each end, and straight between them.

/// The node before a share of a sheet's length among `count` of them (two or more), and how far the share is on the way to the next, 0 to 1.
#[inline]
pub(super) fn split(share: f64, count: usize) -> (usize, f64) {
    let place = share.clamp(0.0, 1.0) * (count - 1) as f64;
    let node = (place as usize).min(count - 2);
    (node, place - node as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_middle_lie_at_their_nodes() {
        assert_eq!(
            [-0.1, 0.0, 0.125, 1.0, 7.0].map(|share| split(share, 5)),
            [(0, 0.0), (0, 0.0), (0, 0.5), (3, 1.0), (3, 1.0),]
        );
    }
}
