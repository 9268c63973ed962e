//! Scenes refer to sheets by number. When sheets are removed, cut or joined, all references to the sheets of that shape are renumbered: links
//! to the shape, and the links, splits and merges of the next transition.

use std::collections::BTreeSet;

use bansho::{
    aurora::shapes::{LinkParameters, MergeParameters, SplitParameters},
    base::parameters::{Auto, Node, Table, Value},
    scene::operation::Operation,
};

use super::{AuroraDrawing, SheetPosition, links::rounded};

/// How an edit changes the sheets of a shape, and with them the positions on its sheets.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum SheetRemap {
    /// These sheets are removed.
    Removed(BTreeSet<usize>),
    /// A sheet is cut here; its second part follows it in the list.
    Cut(SheetPosition),
    /// Two sheets are joined into one, at the smaller of their indices.
    Joined {
        /// The sheets in the order of the joined sheet.
        parts: [JoinedPart; 2],
        /// Fraction of the joined sheet's length where the second part begins.
        seam: f64,
    },
}

/// A sheet that becomes one of two parts of a joined sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct JoinedPart {
    pub(super) sheet: usize,
    /// Whether its direction is reversed.
    pub(super) reversed: bool,
}

impl SheetRemap {
    /// The new position of `position`; `None` where its sheet was removed.
    pub(super) fn apply(&self, position: SheetPosition) -> Option<SheetPosition> {
        let SheetPosition { sheet, fraction } = position;
        let (sheet, fraction) = match *self {
            Self::Removed(ref removed) if removed.contains(&sheet) => return None,
            Self::Removed(ref removed) => (sheet - removed.range(..sheet).count(), fraction),
            Self::Cut(cut) if sheet == cut.sheet && fraction <= cut.fraction => {
                (sheet, fraction / cut.fraction.max(f64::MIN_POSITIVE))
            }
            Self::Cut(cut) if sheet == cut.sheet => (sheet + 1, (fraction - cut.fraction) / (1.0 - cut.fraction)),
            Self::Cut(cut) => (sheet + usize::from(sheet > cut.sheet), fraction),
            Self::Joined { parts, seam } => {
                let sheets = parts.map(|part| part.sheet);
                let (stays, goes) = (sheets[0].min(sheets[1]), sheets[0].max(sheets[1]));
                match parts.iter().position(|part| part.sheet == sheet) {
                    None => (sheet - usize::from(sheet > goes), fraction),
                    Some(part) => {
                        let along = if parts[part].reversed { 1.0 - fraction } else { fraction };
                        (stays, if part == 0 { along * seam } else { seam + along * (1.0 - seam) })
                    }
                }
            }
        };
        Some(SheetPosition { sheet, fraction })
    }

    /// As [`apply`](Self::apply), for a sheet that is counted from 1 and an optional fraction, as scenes state them. Without a fraction, the
    /// start of the sheet is mapped.
    fn apply_one_based(&self, sheet: i64, fraction: Option<f64>) -> Option<(i64, Option<f64>)> {
        let sheet = usize::try_from(sheet - 1).ok()?;
        let mapped = self.apply(SheetPosition { sheet, fraction: fraction.unwrap_or(0.0) })?;
        Some((mapped.sheet as i64 + 1, fraction.map(|_| rounded(mapped.fraction))))
    }

    fn apply_to_arrival(&self, link: &LinkParameters) -> Option<LinkParameters> {
        let (to, to_length_fraction) = self.apply_one_based(link.to, link.to_length_fraction)?;
        Some(LinkParameters { to, to_length_fraction, ..link.clone() })
    }

    fn apply_to_departure(&self, link: &LinkParameters) -> Option<LinkParameters> {
        let (from, from_length_fraction) = self.apply_one_based(link.from, link.from_length_fraction)?;
        Some(LinkParameters { from, from_length_fraction, ..link.clone() })
    }

    fn apply_to_split(&self, split: &SplitParameters) -> Option<SplitParameters> {
        let (sheet, length_fraction) = self.apply_one_based(split.sheet, split.length_fraction)?;
        Some(SplitParameters { sheet, length_fraction, ..split.clone() })
    }

    /// Maps a merge; `None` where one of its ends is no end of a sheet any more.
    fn apply_to_merge(&self, merge: &MergeParameters) -> Option<MergeParameters> {
        let ends = match merge.ends {
            Auto::Auto => [None; 2],
            Auto::Set(ends) => ends.map(Some),
        };
        let (first, first_end) = self.apply_one_based(merge.sheets[0], ends[0])?;
        let (second, second_end) = self.apply_one_based(merge.sheets[1], ends[1])?;
        let still_ends = [first_end, second_end].into_iter().flatten().all(|end| end == 0.0 || end == 1.0);
        let ends = first_end.zip(second_end).map_or(Auto::Auto, |(first, second)| Auto::Set([first, second]));
        (still_ends && first != second).then_some(MergeParameters { sheets: [first, second], ends })
    }
}

impl AuroraDrawing {
    /// The operations that renumber all references to sheets of the shapes from `first` on, which changed by `remaps`. `update_link` changes
    /// the links from the unchanged shape before `first`. The splits to a shape that `needless` returns are removed.
    pub(super) fn renumbered(
        &self,
        first: usize,
        remaps: &[SheetRemap],
        update_link: impl Fn(&LinkParameters) -> LinkParameters,
        needless: impl Fn(usize) -> Vec<usize>,
    ) -> Vec<Operation> {
        let mut operations = Vec::new();
        for shape in first..=first + remaps.len() {
            let arrives = remaps.get(shape - first);
            let leaves = shape.checked_sub(first + 1).and_then(|before| remaps.get(before));
            operations.extend(self.relinked(shape, |link| {
                let link = leaves.map_or_else(|| Some(update_link(link)), |remap| remap.apply_to_departure(link))?;
                arrives.map_or(Some(link.clone()), |remap| remap.apply_to_arrival(&link))
            }));
            let needless = if arrives.is_some() { needless(shape) } else { Vec::new() };
            operations.extend(self.resplit(shape, leaves, &needless));
            operations.extend(leaves.and_then(|remap| self.remerged(shape, remap)));
        }
        operations
    }

    /// The operation that updates the splits to shape `shape` after `remap` of the shape before, and removes those with the indices
    /// `needless`; `None` where nothing changes.
    fn resplit(&self, shape: usize, remap: Option<&SheetRemap>, needless: &[usize]) -> Option<Operation> {
        let old = &self.parameters.shapes.get(shape)?.split;
        let kept = old.iter().enumerate().filter(|(number, _)| !needless.contains(number)).map(|(_, split)| split);
        let new: Vec<SplitParameters> =
            kept.filter_map(|split| remap.map_or(Some(split.clone()), |remap| remap.apply_to_split(split))).collect();
        (new != *old).then(|| self.set_list(shape, "split", new.iter().map(split_table).collect()))
    }

    /// The operation that updates the merges to shape `shape` after `remap` of the shape before; `None` where nothing changes.
    fn remerged(&self, shape: usize, remap: &SheetRemap) -> Option<Operation> {
        let old = &self.parameters.shapes.get(shape)?.merge;
        let new: Vec<MergeParameters> = old.iter().filter_map(|merge| remap.apply_to_merge(merge)).collect();
        (new != *old).then(|| self.set_list(shape, "merge", new.iter().map(merge_table).collect()))
    }

    /// The operations that change, or with `None` remove, each link to shape `shape`.
    fn relinked(&self, shape: usize, change: impl Fn(&LinkParameters) -> Option<LinkParameters>) -> Vec<Operation> {
        let links = self.links(shape);
        let new: Vec<LinkParameters> = links.iter().filter_map(change).collect();
        if new == links { Vec::new() } else { self.set_links(shape, new) }
    }

    /// The operation that sets the list `key` of shape `shape`, or removes it where it would be empty.
    pub(super) fn set_list(&self, shape: usize, key: &str, tables: Vec<Table>) -> Operation {
        let path = self.shape(shape).key(key);
        if tables.is_empty() {
            return Operation::Remove { path };
        }
        Operation::Set {
            path,
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

/// A list of two whole numbers.
pub(super) fn integers(numbers: [i64; 2]) -> Value {
    Value::List(numbers.map(|number| Node::from(Value::Integer(number))).into())
}

fn merge_table(merge: &MergeParameters) -> Table {
    let mut table = Table::default();
    table.push("sheets", integers(merge.sheets));
    if let Auto::Set(ends) = merge.ends {
        table.push("ends", integers(ends.map(|end| end as i64)));
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(sheet: usize, fraction: f64) -> SheetPosition {
        SheetPosition { sheet, fraction }
    }

    fn joined(parts: [(usize, bool); 2]) -> SheetRemap {
        SheetRemap::Joined { parts: parts.map(|(sheet, reversed)| JoinedPart { sheet, reversed }), seam: 0.5 }
    }

    #[test]
    fn positions_follow_their_sheets() {
        assert_eq!(
            [0, 1, 2].map(|sheet| SheetRemap::Removed([1].into()).apply(at(sheet, 0.5))),
            [Some(at(0, 0.5)), None, Some(at(1, 0.5))]
        );
        let cut = SheetRemap::Cut(at(1, 0.25));
        assert_eq!(
            [at(0, 0.9), at(1, 0.125), at(1, 0.625), at(2, 0.1)].map(|position| cut.apply(position)),
            [at(0, 0.9), at(1, 0.5), at(2, 0.5), at(3, 0.1)].map(Some)
        );
        // Sheet 3 is reversed and ends where sheet 1 begins.
        let joined = joined([(3, true), (1, false)]);
        assert_eq!(
            [at(3, 1.0), at(3, 0.0), at(1, 0.5), at(2, 0.3), at(4, 0.3)].map(|position| joined.apply(position)),
            [at(1, 0.0), at(1, 0.5), at(1, 0.75), at(2, 0.3), at(3, 0.3)].map(Some)
        );
    }

    #[test]
    fn merges_without_their_ends_are_removed() {
        let merge = MergeParameters { sheets: [1, 3], ends: Auto::Set([1.0, 0.0]) };
        let after = |remap: SheetRemap| remap.apply_to_merge(&merge);
        assert_eq!(after(SheetRemap::Removed([1].into())), Some(MergeParameters { sheets: [1, 2], ..merge.clone() }));
        assert_eq!(after(SheetRemap::Removed([2].into())), None);
        assert_eq!(after(SheetRemap::Cut(at(0, 0.5))), Some(MergeParameters { sheets: [2, 4], ..merge.clone() }));
        assert_eq!(after(joined([(0, false), (1, false)])), None, "the seam is no end");
    }
}
