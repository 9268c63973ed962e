//! Removing a sheet from all shapes: with the sheets that only come from it, and those that only become it.

use std::collections::BTreeSet;

use bansho::{
    aurora::shapes::{LinkParameters, SplitParameters},
    scene::operation::Operation,
};

use super::{AuroraDrawing, changes::RemappedSheets, polyline, renumber::SheetRemap};

/// A strand: a segment of a sheet that becomes a segment of a sheet of the next shape.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Strand {
    /// Index of the sheet on the earlier shape.
    from: usize,
    /// Index of the sheet on the later shape.
    to: usize,
}

impl AuroraDrawing {
    /// Removes sheet `sheet` of shape `shape`, and from the other shapes the sheets that only become removed sheets or only come from
    /// removed ones. Of a sheet that splits, only the half that becomes the removed sheet is removed; of sheets that merge, likewise.
    pub fn remove_sheet(&self, shape: usize, sheet: usize) -> Vec<Operation> {
        let mut gone: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); self.arrivals().len()];
        gone[shape].insert(sheet);
        let strands: Vec<Vec<Strand>> = (1..gone.len()).map(|shape| self.strands(shape - 1)).collect();
        for before in (0..shape).rev() {
            let reversed = strands[before].iter().map(|&Strand { from, to }| Strand { from: to, to: from });
            gone[before] = reached_only_from(&reversed.collect::<Vec<_>>(), &gone[before + 1]);
        }
        for before in shape..strands.len() {
            gone[before + 1] = reached_only_from(&strands[before], &gone[before]);
        }
        let first = gone.iter().position(|sheets| !sheets.is_empty()).unwrap_or(shape);
        let changed: Vec<_> = (first..gone.len())
            .take_while(|&shape| !gone[shape].is_empty())
            .map(|shape| {
                let kept = self.sheets(shape).into_iter().enumerate().filter(|(sheet, _)| !gone[shape].contains(sheet));
                let sheets = kept.map(|(_, sheet)| sheet).collect();
                RemappedSheets { sheets, remap: SheetRemap::Removed(gone[shape].clone()) }
            })
            .collect();
        self.write_all(first, &changed, LinkParameters::clone, |shape| match shape.checked_sub(1) {
            Some(before) => self.needless_splits(shape, &strands[before], [&gone[before], &gone[shape]]),
            None => Vec::new(),
        })
    }

    /// The strands from shape `before` to the next, in the order of its sheets and along each.
    fn strands(&self, before: usize) -> Vec<Strand> {
        let [leaving, arriving] = [before, before + 1].map(|shape| self.lines(shape));
        let point_paths = self.point_paths(before);
        let ends = point_paths.iter().filter_map(|strand| {
            let [from, to] = *strand.get(strand.len() / 2)?;
            Some(Strand {
                from: polyline::nearest_among(&leaving, from)?.0,
                to: polyline::nearest_among(&arriving, to)?.0,
            })
        });
        ends.collect()
    }

    /// Indices of the splits in the transition to shape `shape` that are obsolete: as many of each remaining sheet as it has removed parts.
    /// The removed sheets are `before` on the earlier and `after` on the later shape.
    fn needless_splits(&self, shape: usize, strands: &[Strand], [before, after]: [&BTreeSet<usize>; 2]) -> Vec<usize> {
        let Some(parameters) = self.parameters.shapes.get(shape) else { return Vec::new() };
        let staying = strands.iter().map(|strand| strand.from).filter(|from| !before.contains(from));
        let mut needless = Vec::new();
        for sheet in staying.collect::<BTreeSet<_>>() {
            let cuts = cuts_along(&parameters.split, sheet);
            let parts = strands.iter().filter(|strand| strand.from == sheet).enumerate();
            // Each part but the first begins at a cut.
            let gone = parts.filter(|(_, strand)| after.contains(&strand.to)).map(|(part, _)| part.saturating_sub(1));
            needless.extend(gone.filter_map(|cut| cuts.get(cut).copied()));
        }
        needless
    }
}

/// The numbers of the splits of sheet `sheet`, from its beginning to its end.
fn cuts_along(splits: &[SplitParameters], sheet: usize) -> Vec<usize> {
    let of_sheet = splits.iter().enumerate().filter(|(_, split)| split.sheet == sheet as i64 + 1);
    let mut cuts: Vec<(usize, &SplitParameters)> = of_sheet.collect();
    cuts.sort_by(|(_, a), (_, b)| {
        let [at_a, at_b] = [a, b].map(|split| split.length_fraction.unwrap_or(0.5));
        a.segment.cmp(&b.segment).then(at_a.total_cmp(&at_b))
    });
    cuts.into_iter().map(|(number, _)| number).collect()
}

/// The sheets that strands reach from the sheets `gone` and from no others.
fn reached_only_from(strands: &[Strand], gone: &BTreeSet<usize>) -> BTreeSet<usize> {
    let (from_gone, others): (Vec<&Strand>, Vec<&Strand>) =
        strands.iter().partition(|strand| gone.contains(&strand.from));
    let mut reached: BTreeSet<usize> = from_gone.into_iter().map(|strand| strand.to).collect();
    for strand in others {
        reached.remove(&strand.to);
    }
    reached
}
