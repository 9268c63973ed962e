//! Piecewise linear functions on uniformly spaced nodes along each sheet.

/// Node before a fraction of a sheet's length with `count` nodes (two or more), and the interpolation fraction.
#[inline]
pub(crate) fn split(fraction: f64, count: usize) -> (usize, f64) {
    let coordinate = fraction.clamp(0.0, 1.0) * (count - 1) as f64;
    let node = (coordinate as usize).min(count - 2);
    (node, coordinate - node as f64)
}

/// Number of nodes per sheet, in proportion to its length.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct NodeLayout {
    /// Start of each sheet's nodes, and the total.
    starts: Vec<usize>,
}

impl NodeLayout {
    /// Divides sheets of these lengths into about `count` intervals, with the minimum and maximum `bounds` per sheet.
    pub(crate) fn new(lengths: &[f64], count: f64, bounds: [f64; 2]) -> Self {
        let whole = lengths.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let mut starts = vec![0];
        for length in lengths {
            let intervals = (count * length / whole).round().clamp(bounds[0], bounds[1]) as usize;
            starts.push(starts[starts.len() - 1] + intervals + 1);
        }
        Self { starts }
    }

    /// Number of nodes of a sheet.
    pub(crate) fn count(&self, sheet: usize) -> usize {
        self.starts[sheet + 1] - self.starts[sheet]
    }
}

/// A value at each node.
#[derive(Clone, Debug)]
pub(crate) struct NodeValues<'a> {
    layout: &'a NodeLayout,
    values: Vec<f64>,
}

impl<'a> NodeValues<'a> {
    /// Zero at all nodes.
    pub(crate) fn new(layout: &'a NodeLayout) -> Self {
        Self { layout, values: vec![0.0; layout.starts[layout.starts.len() - 1]] }
    }

    /// Sheet length per node, km: half an interval on each side.
    pub(crate) fn of_lengths(layout: &'a NodeLayout, lengths: &[f64]) -> Self {
        let mut nodes = Self::new(layout);
        for (sheet, length) in lengths.iter().enumerate() {
            let nodes = &mut nodes.values[layout.starts[sheet]..layout.starts[sheet + 1]];
            let last = nodes.len() - 1;
            let interval = length / last as f64;
            nodes.fill(interval);
            (nodes[0], nodes[last]) = (0.5 * interval, 0.5 * interval);
        }
        nodes
    }

    /// Index of the node before a position, over all sheets, and the interpolation fraction.
    #[inline]
    fn split(&self, sheet: u32, fraction: f32) -> (usize, f64) {
        let (node, t) = split(f64::from(fraction), self.layout.count(sheet as usize));
        (self.layout.starts[sheet as usize] + node, t)
    }

    /// Adds a value with linear weights to the two nodes around a position.
    #[inline]
    pub(crate) fn add(&mut self, sheet: u32, fraction: f32, value: f64) {
        let (node, t) = self.split(sheet, fraction);
        self.values[node] += value * (1.0 - t);
        self.values[node + 1] += value * t;
    }

    /// Value at a position, linear between nodes.
    #[inline]
    pub(crate) fn at(&self, sheet: u32, fraction: f32) -> f64 {
        let (node, t) = self.split(sheet, fraction);
        self.values[node] + t * (self.values[node + 1] - self.values[node])
    }

    /// Sum of both.
    pub(crate) fn plus(mut self, other: &Self) -> Self {
        self.values.iter_mut().zip(&other.values).for_each(|(sum, value)| *sum += value);
        self
    }

    /// Sum of all values.
    pub(crate) fn sum(&self) -> f64 {
        self.values.iter().sum()
    }

    /// Power per unit of weight at each node, at most about `max_concentration` times the mean, such that the total power is
    /// distributed. Nodes with nearly no weight cannot take all of their power, which goes to the others.
    pub(crate) fn distributed_by(mut self, weights: &Self, max_concentration: f64) -> Self {
        let (whole, weight) = (self.sum(), weights.sum());
        let max_factor = if weight > 0.0 { max_concentration * whole / weight } else { 0.0 };
        let mut distributed = 0.0;
        for (power, weight) in self.values.iter_mut().zip(&weights.values) {
            *power = (*power / weight.max(f64::MIN_POSITIVE)).min(max_factor);
            distributed += *power * weight;
        }
        let correction = if distributed > 0.0 { whole / distributed } else { 0.0 };
        self.values.iter_mut().for_each(|factor| *factor *= correction);
        self
    }

    /// The values of a sheet.
    #[cfg(test)]
    pub(crate) fn of_sheet(&self, sheet: usize) -> &[f64] {
        &self.values[self.layout.starts[sheet]..self.layout.starts[sheet + 1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_middle_lie_at_their_nodes() {
        assert_eq!(
            [-0.1, 0.0, 0.125, 1.0, 7.0].map(|fraction| split(fraction, 5)),
            [(0, 0.0), (0, 0.0), (0, 0.5), (3, 1.0), (3, 1.0),]
        );
    }

    #[test]
    fn long_sheets_have_more_nodes_and_all_of_them_no_more_than_asked_for() {
        let layout = NodeLayout::new(&[300.0, 100.0, 0.0], 40.0, [4.0, 25.0]);
        assert_eq!([0, 1, 2].map(|sheet| layout.count(sheet)), [26, 11, 5]);
        assert_eq!(NodeLayout::new(&[], 40.0, [4.0, 25.0]), NodeLayout { starts: vec![0] });
    }

    #[test]
    fn what_is_given_out_is_all_there_is() {
        let layout = NodeLayout::new(&[300.0, 100.0], 12.0, [2.0, 25.0]);
        let lengths = NodeValues::of_lengths(&layout, &[300.0, 100.0]);
        assert!((lengths.sum() - 400.0).abs() < 1e-9);
        let mut weights = NodeValues::new(&layout);
        for (sheet, fraction, weight) in [(0, 0.1, 3.0), (0, 0.57, 1.0), (1, 0.2, 2.0)] {
            weights.add(sheet, fraction, weight);
        }
        let factors = lengths.distributed_by(&weights, 1e9);
        let given: f64 = factors.values.iter().zip(&weights.values).map(|(factor, weight)| factor * weight).sum();
        assert!((given - 400.0).abs() < 1e-9, "{given}");
        // To nobody nothing can be given.
        let factors = NodeValues::of_lengths(&layout, &[300.0, 100.0]).distributed_by(&NodeValues::new(&layout), 6.0);
        assert!(factors.values.iter().all(|factor| *factor == 0.0));
    }
}
