//! By which values a table follows the paper of its method to the letter.

use std::fmt;

/// How tables of a kind follow a paper.
#[derive(Clone, Copy, Debug)]
pub struct PaperSettings {
    /// Its authors.
    pub paper: &'static str,
    /// Values of the table's keys.
    pub settings: &'static [PaperSetting],
    /// Values of keys of the whole scene, such as `picture.view`.
    pub scene_settings: &'static [PaperSetting],
}

/// A key, and the values with which it follows the paper.
#[derive(Clone, Copy, Debug)]
pub struct PaperSetting {
    /// The key, with sub-tables separated by dots. `list.*.key` is the key of every item of a list.
    pub key: &'static str,
    /// The values that do.
    pub allowed: PaperValues,
    /// Where the paper says so, or what the value is for: a phrase that follows the name of the paper and a comma.
    pub source: &'static str,
}

/// Values of a key with which it follows a paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PaperValues {
    /// These, in the syntax of scene files; an empty one is a key without a value.
    OneOf(&'static [&'static str]),
    /// Any number above 0, since the paper has the effect but does not state its strength.
    AboveZero,
}

impl fmt::Display for PaperValues {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::OneOf(texts) => {
                for (index, text) in texts.iter().enumerate() {
                    let separator = if index > 0 { " or " } else { "" };
                    let text = if text.is_empty() { "none" } else { text };
                    write!(formatter, "{separator}{text}")?;
                }
                Ok(())
            }
            Self::AboveZero => formatter.write_str("a number above 0"),
        }
    }
}

impl PaperSetting {
    /// A key and the values with which it follows the paper.
    #[must_use]
    pub const fn new(key: &'static str, allowed: &'static [&'static str], source: &'static str) -> Self {
        Self { key, allowed: PaperValues::OneOf(allowed), source }
    }

    /// The strength of an effect that the paper has without a value.
    #[must_use]
    pub const fn above_zero(key: &'static str, source: &'static str) -> Self {
        Self { key, allowed: PaperValues::AboveZero, source }
    }
}
