//! Sheets are counted. When one goes, is cut or is joined, what counts them follows: links to the shape, and the links, splits and
//! merges that lead away from it.

use std::collections::BTreeSet;

use bansho::{
    aurora::shapes::{LinkParameters, MergeParameters, SplitParameters},
    base::parameters::{Auto, Node, Table, Value},
    scene::operation::Operation,
};

use super::{AuroraDrawing, SheetPosition, links::rounded};

/// What becomes of places on the sheets of a shape.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum SheetRemap {
    /// These sheets are gone.
    Gone(BTreeSet<usize>),
    /// This sheet is cut at a share of its length; its second part comes after it.
    Cut(SheetPosition),
    /// Two sheets are one, at the place of the first in the list: each with whether it was turned round, and the share of the
    /// length that the first to be run through has.
    Joined([(usize, bool); 2], f64),
}

impl SheetRemap {
    /// Where a place is now, if it is still there.
    pub(super) fn of(&self, (sheet, fraction): SheetPosition) -> Option<SheetPosition> {
        Some(match *self {
            Self::Gone(ref gone) if gone.contains(&sheet) => return None,
            Self::Gone(ref gone) => (sheet - gone.range(..sheet).count(), fraction),
            Self::Cut((cut, at)) if sheet == cut && fraction <= at => (cut, fraction / at.max(f64::MIN_POSITIVE)),
            Self::Cut((cut, at)) if sheet == cut => (cut + 1, (fraction - at) / (1.0 - at)),
            Self::Cut((cut, _)) => (sheet + usize::from(sheet > cut), fraction),
            Self::Joined(parts, seam) => {
                let sheets = parts.map(|(own, _)| own);
                let (stays, goes) = (sheets[0].min(sheets[1]), sheets[0].max(sheets[1]));
                match parts.iter().position(|(own, _)| *own == sheet) {
                    None => (sheet - usize::from(sheet > goes), fraction),
                    Some(part) => {
                        let along = if parts[part].1 { 1.0 - fraction } else { fraction };
                        (stays, if part == 0 { along * seam } else { seam + along * (1.0 - seam) })
                    }
                }
            }
        })
    }

    /// The same for a sheet counted from 1, and a place on it where one is told.
    fn counted(&self, sheet: i64, fraction: Option<f64>) -> Option<(i64, Option<f64>)> {
        // Without a place the beginning is meant.
        let (sheet, at) = self.of((usize::try_from(sheet - 1).ok()?, fraction.unwrap_or(0.0)))?;
        Some((sheet as i64 + 1, fraction.map(|_| rounded(at))))
    }

    fn of_arrival(&self, link: &LinkParameters) -> Option<LinkParameters> {
        let (to, to_length_fraction) = self.counted(link.to, link.to_length_fraction)?;
        Some(LinkParameters { to, to_length_fraction, ..link.clone() })
    }

    fn of_departure(&self, link: &LinkParameters) -> Option<LinkParameters> {
        let (from, from_length_fraction) = self.counted(link.from, link.from_length_fraction)?;
        Some(LinkParameters { from, from_length_fraction, ..link.clone() })
    }

    fn of_split(&self, split: &SplitParameters) -> Option<SplitParameters> {
        let (sheet, length_fraction) = self.counted(split.sheet, split.length_fraction)?;
        Some(SplitParameters { sheet, length_fraction, ..split.clone() })
    }

    /// Ends that are ends no longer do not merge.
    fn of_merge(&self, merge: &MergeParameters) -> Option<MergeParameters> {
        let ends = match merge.ends {
            Auto::Auto => [None; 2],
            Auto::Set(ends) => ends.map(Some),
        };
        let one = self.counted(merge.sheets[0], ends[0])?;
        let other = self.counted(merge.sheets[1], ends[1])?;
        let still_ends = [one.1, other.1].into_iter().flatten().all(|end| end == 0.0 || end == 1.0);
        let ends = one.1.zip(other.1).map_or(Auto::Auto, |(one, other)| Auto::Set([one, other]));
        (still_ends && one.0 != other.0).then_some(MergeParameters { sheets: [one.0, other.0], ends })
    }
}

impl AuroraDrawing {
    /// Lets everything follow that counts sheets of the shapes from `first` on, of which `remaps` tells what became of them; `begun`
    /// changes the links from the shape before, which stays, and splits to a shape that are `needless` go.
    pub(super) fn renumbered(
        &self,
        first: usize,
        remaps: &[SheetRemap],
        begun: impl Fn(&LinkParameters) -> LinkParameters,
        needless: impl Fn(usize) -> Vec<usize>,
    ) -> Vec<Operation> {
        let mut operations = Vec::new();
        for shape in first..=first + remaps.len() {
            let arrives = remaps.get(shape - first);
            let leaves = shape.checked_sub(first + 1).and_then(|before| remaps.get(before));
            operations.extend(self.relinked(shape, |link| {
                let link = leaves.map_or_else(|| Some(begun(link)), |remap| remap.of_departure(link))?;
                arrives.map_or(Some(link.clone()), |remap| remap.of_arrival(&link))
            }));
            let needless = if arrives.is_some() { needless(shape) } else { Vec::new() };
            operations.extend(self.resplit(shape, leaves, &needless));
            operations.extend(leaves.and_then(|remap| self.remerged(shape, remap)));
        }
        operations
    }

    /// The splits to shape `shape` after a fate of the one before, without those that are `needless`, by number.
    fn resplit(&self, shape: usize, remap: Option<&SheetRemap>, needless: &[usize]) -> Option<Operation> {
        let old = &self.parameters.shapes.get(shape)?.split;
        let kept = old.iter().enumerate().filter(|(number, _)| !needless.contains(number)).map(|(_, split)| split);
        let new: Vec<SplitParameters> =
            kept.filter_map(|split| remap.map_or(Some(split.clone()), |remap| remap.of_split(split))).collect();
        (new != *old).then(|| self.set_list(shape, "split", new.iter().map(split_table).collect()))
    }

    /// The merges to shape `shape` after `remap` of the one before.
    fn remerged(&self, shape: usize, remap: &SheetRemap) -> Option<Operation> {
        let old = &self.parameters.shapes.get(shape)?.merge;
        let new: Vec<MergeParameters> = old.iter().filter_map(|merge| remap.of_merge(merge)).collect();
        (new != *old).then(|| self.set_list(shape, "merge", new.iter().map(merge_table).collect()))
    }

    /// The links to shape `shape` after each was changed, or went.
    fn relinked(&self, shape: usize, change: impl Fn(&LinkParameters) -> Option<LinkParameters>) -> Vec<Operation> {
        let links = self.links(shape);
        let new: Vec<LinkParameters> = links.iter().filter_map(change).collect();
        if new == links { Vec::new() } else { self.set_links(shape, new) }
    }

    /// States the list `key` of shape `shape`, or takes it out where it is empty.
    pub(super) fn set_list(&self, shape: usize, key: &str, tables: Vec<Table>) -> Operation {
        let place = self.shape(shape).key(key);
        if tables.is_empty() {
            return Operation::Remove { path: place };
        }
        Operation::Set {
            path: place,
            value: Value::List(tables.into_iter().map(|table| Value::Table(table).into()).collect()),
        }
    }
}

fn split_table(split: &SplitParameters) -> Table {
    let mut table = Table::default();
    table.push("sheet", Value::Integer(split.sheet));
    split.segment.into_iter().for_each(|segment| table.push("segment", Value::Integer(segment)));
    split.length_fraction.into_iter().for_each(|at| table.push("length_fraction", Value::Number(at)));
    table
}

fn merge_table(merge: &MergeParameters) -> Table {
    let whole = |numbers: [i64; 2]| Value::List(numbers.map(|number| Node::from(Value::Integer(number))).into());
    let mut table = Table::default();
    table.push("sheets", whole(merge.sheets));
    if let Auto::Set(ends) = merge.ends {
        table.push("ends", whole(ends.map(|end| end as i64)));
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_follow_their_sheets() {
        assert_eq!(
            [0, 1, 2].map(|sheet| SheetRemap::Gone([1].into()).of((sheet, 0.5))),
            [Some((0, 0.5)), None, Some((1, 0.5))]
        );
        let cut = SheetRemap::Cut((1, 0.25));
        assert_eq!(
            [(0, 0.9), (1, 0.125), (1, 0.625), (2, 0.1)].map(|place| cut.of(place)),
            [Some((0, 0.9)), Some((1, 0.5)), Some((2, 0.5)), Some((3, 0.1)),]
        );
        // Sheet 3 runs back to its beginning, where sheet 1 goes on.
        let joined = SheetRemap::Joined([(3, true), (1, false)], 0.5);
        assert_eq!(
            [(3, 1.0), (3, 0.0), (1, 0.5), (2, 0.3), (4, 0.3)].map(|place| joined.of(place)),
            [Some((1, 0.0)), Some((1, 0.5)), Some((1, 0.75)), Some((2, 0.3)), Some((3, 0.3)),]
        );
    }

    #[test]
    fn merges_of_what_are_ends_no_longer_go() {
        let merge = MergeParameters { sheets: [1, 3], ends: Auto::Set([1.0, 0.0]) };
        let after = |remap: SheetRemap| remap.of_merge(&merge);
        assert_eq!(after(SheetRemap::Gone([1].into())), Some(MergeParameters { sheets: [1, 2], ..merge.clone() }));
        assert_eq!(after(SheetRemap::Gone([2].into())), None);
        assert_eq!(after(SheetRemap::Cut((0, 0.5))), Some(MergeParameters { sheets: [2, 4], ..merge.clone() }));
        assert_eq!(after(SheetRemap::Joined([(0, false), (1, false)], 0.5)), None, "the seam is no end");
    }
}
