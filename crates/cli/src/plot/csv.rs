//! Tables as CSV (RFC 4180), and back.

use bansho::{base::host::printable::printable, media::files::provenance};

use super::figure::FigureTable;

/// Digits that are written: more than single precision holds.
const DIGITS: i32 = 8;

/// A comment with the provenance mark and the title, a line of column names, then a line for each row.
pub(crate) fn encode(title: &str, table: &FigureTable) -> String {
    let mut text = format!("# {}; {}\n", provenance::COMMENT_TAG, printable(title));
    let names: Vec<String> = table.columns.iter().map(|name| quoted(name)).collect();
    text += &names.join(",");
    text.push('\n');
    for row in &table.rows {
        let cells: Vec<String> = row.iter().map(|&value| number(value)).collect();
        text += &cells.join(",");
        text.push('\n');
    }
    text
}

/// Numbers of a table that is compiled in: a line of names, then rows of numbers.
pub(crate) fn rows<const N: usize>(text: &str) -> Vec<[f64; N]> {
    let mut rows = Vec::new();
    for line in text.lines().skip(1) {
        let mut fields = line.split(',').map(|field| field.parse().unwrap_or(f64::NAN));
        rows.push(std::array::from_fn(|_| fields.next().unwrap_or(f64::NAN)));
    }
    rows
}

fn quoted(name: &str) -> String {
    let name = printable(name);
    if name.contains([',', '"']) { format!("\"{}\"", name.replace('"', "\"\"")) } else { name.into_owned() }
}

/// A number in the fewest digits, up to [`DIGITS`]; nothing for one that is not finite.
pub(crate) fn number(value: f64) -> String {
    if !value.is_finite() {
        return String::new();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    // As it is rounded: 9.999999999 has the exponent of 10.
    let scientific = format!("{value:.*e}", DIGITS as usize - 1);
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-5..10).contains(&exponent) {
        trimmed(&format!("{value:.*}", (DIGITS - 1 - exponent).max(0) as usize)).to_owned()
    } else {
        format!("{}e{exponent}", trimmed(mantissa))
    }
}

/// Without zeros at the end of the decimals.
fn trimmed(number: &str) -> &str {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_come_back() {
        for (value, text) in [
            (0.0, "0"),
            (-1.5, "-1.5"),
            (100.0, "100"),
            (0.1_f32.into(), "0.1"),
            (1.0 / 3.0, "0.33333333"),
            (9.999_999_999, "10"),
            (-69.077_55, "-69.07755"),
            (1.5e-30, "1.5e-30"),
            (3.0e12, "3e12"),
            (f64::NAN, ""),
            (f64::INFINITY, ""),
        ] {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn names_with_commas_are_quoted() {
        let table = FigureTable { columns: vec!["a, \"b\"".into(), "c".into()], rows: vec![vec![1.0, f64::NAN]] };
        assert!(encode("t", &table).ends_with("; t\n\"a, \"\"b\"\"\",c\n1,\n"));
    }
}
