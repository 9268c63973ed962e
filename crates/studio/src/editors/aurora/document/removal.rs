//! Removing a sheet from all shapes: with the sheets that only come from it, and those that only become it.

use std::collections::BTreeSet;

use bansho::{aurora::shapes::LinkParameters, scene::operation::Operation};

use super::{AuroraDrawing, polyline, renumber::SheetRemap};

/// Strands from a shape to the next: the sheet of each before and after.
type Strands = Vec<(usize, usize)>;

impl AuroraDrawing {
    /// Without sheet `sheet` of shape `shape`, without sheets that only become what is gone, and without those that only come of it.
    /// A sheet that split off goes by itself, and so does one that would have grown together with another.
    pub fn remove_sheet(&self, shape: usize, sheet: usize) -> Vec<Operation> {
        let mut gone: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); self.arrivals().len()];
        gone[shape].insert(sheet);
        let point_paths: Vec<Strands> = (1..gone.len()).map(|shape| self.strands(shape - 1)).collect();
        for before in (0..shape).rev() {
            let turned: Strands = point_paths[before].iter().map(|&(from, to)| (to, from)).collect();
            gone[before] = only_of(&turned, &gone[before + 1]);
        }
        for before in shape..point_paths.len() {
            gone[before + 1] = only_of(&point_paths[before], &gone[before]);
        }
        let first = gone.iter().position(|sheets| !sheets.is_empty()).unwrap_or(shape);
        let changed: Vec<_> = (first..gone.len())
            .take_while(|&shape| !gone[shape].is_empty())
            .map(|shape| {
                let kept = self.sheets(shape).into_iter().enumerate().filter(|(sheet, _)| !gone[shape].contains(sheet));
                (kept.map(|(_, sheet)| sheet).collect(), SheetRemap::Gone(gone[shape].clone()))
            })
            .collect();
        let needless = |shape: usize| match shape.checked_sub(1) {
            Some(before) => self.needless_splits(shape, &point_paths[before], [&gone[before], &gone[shape]]),
            None => Vec::new(),
        };
        self.write_all(first, &changed, LinkParameters::clone, needless)
    }

    /// The strands from shape `before` to the next, in the order of its sheets and along each.
    fn strands(&self, before: usize) -> Strands {
        let [leaving, arriving] = [before, before + 1].map(|shape| self.lines(shape));
        let point_paths = self.point_paths(before);
        let ends = point_paths.iter().filter_map(|strand| {
            let [from, to] = *strand.get(strand.len() / 2)?;
            Some((polyline::nearest_among(&leaving, from)?.0, polyline::nearest_among(&arriving, to)?.0))
        });
        ends.collect()
    }

    /// The splits to shape `shape`, by number, that a sheet of the shape before no longer needs, as many as it has parts among what is gone.
    fn needless_splits(&self, shape: usize, strands: &Strands, [before, after]: [&BTreeSet<usize>; 2]) -> Vec<usize> {
        let Some(parameters) = self.parameters.shapes.get(shape) else { return Vec::new() };
        let staying = strands.iter().map(|(from, _)| *from).filter(|from| !before.contains(from));
        let of_sheet = |sheet: usize| {
            let splits = parameters.split.iter().enumerate();
            let mut cuts: Vec<usize> =
                splits.filter(|(_, split)| split.sheet == sheet as i64 + 1).map(|(number, _)| number).collect();
            let place = |number: usize| {
                (parameters.split[number].segment, parameters.split[number].length_fraction.unwrap_or(0.5))
            };
            cuts.sort_by(|&a, &b| {
                let (a, b) = (place(a), place(b));
                a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
            });
            let parts = strands.iter().filter(move |(from, _)| *from == sheet).map(|(_, to)| after.contains(to));
            // Each part but the first begins at a cut.
            let gone = parts.enumerate().filter(|(_, gone)| *gone).map(|(part, _)| part.saturating_sub(1));
            let numbers: Vec<usize> = gone.filter_map(|cut| cuts.get(cut).copied()).collect();
            numbers
        };
        staying.collect::<BTreeSet<_>>().into_iter().flat_map(of_sheet).collect()
    }
}

/// The sheets that strands lead to from `gone` alone.
fn only_of(strands: &Strands, gone: &BTreeSet<usize>) -> BTreeSet<usize> {
    let stays = |sheet: usize| strands.iter().any(|(from, to)| *to == sheet && !gone.contains(from));
    strands.iter().filter(|(from, to)| gone.contains(from) && !stays(*to)).map(|(_, to)| *to).collect()
}
