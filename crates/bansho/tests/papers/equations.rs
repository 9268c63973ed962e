//! The equations of each method: the tables of the book and of the crates agree, are complete, and name functions that exist.
//!
//! A table has the columns `equation`, `what it says` and `function`; further columns are not read. The first cell of a row holds
//! equation numbers, as in `(2.4), (2.5)` or `(14) to (16)`, or the name of something without a number, as in `section 5.2`.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use crate::sources::{cells, crate_source, exists, read};

const BOOK: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/src/methods");

/// A method of the book, and the module that implements it.
struct Method {
    /// Page in the folder `docs/src/methods`.
    page: &'static str,
    /// Folder of the crate in `crates`.
    in_crate: &'static str,
    /// Module whose documentation contains the table; empty for the root of the crate.
    module: &'static str,
    /// All equation numbers of the paper, without parentheses.
    required: &'static [&'static str],
}

/// Ohshima and Itahashi: (8) and (19) do not exist.
const FLAME_SHEET: [&str; 18] =
    ["1", "2", "3", "4", "5", "6", "7", "9", "10", "11", "12", "13", "14", "15", "16", "17", "18", "20"];

/// Inagaki et al.
const FLAME_PARTICLES: [&str; 17] =
    ["1", "2", "3", "4", "5", "6", "7", "8", "9", "10", "11", "12", "13", "14", "15", "16", "17"];

/// Yoshida, Dobashi and Yamamoto.
const RAIN: [&str; 4] = ["1", "2", "3", "4"];

/// Sekiguchi.
const AURORA: [&str; 30] = [
    "2.1", "2.2", "2.3", "2.4", "2.5", "2.6", "2.7", "2.8", "2.9", "2.10", "2.11", "2.12", "2.13", "2.14", "2.15",
    "2.16", "2.17", "2.18", "2.19", "2.20", "2.21", "2.22", "2.23", "2.24", "2.25", "2.26", "2.27", "2.28", "2.29",
    "2.30",
];

const METHODS: [Method; 4] = [
    Method { page: "flame-sheet.md", in_crate: "fire", module: "sheet", required: &FLAME_SHEET },
    Method { page: "flame-particles.md", in_crate: "fire", module: "particles", required: &FLAME_PARTICLES },
    Method { page: "rain.md", in_crate: "rain", module: "", required: &RAIN },
    Method { page: "aurora.md", in_crate: "aurora", module: "", required: &AURORA },
];

/// How an equation is implemented.
#[derive(Clone, Debug, PartialEq)]
enum Implementation {
    /// Paths within the crate, or from the root of another crate of the workspace (`bansho_sph::Poly6`).
    By(BTreeSet<String>),
    /// The cell is "not used: " and the reason.
    NotUsed,
}

/// The entry of a table for each equation number, or for each name of something without a number.
type Equations = BTreeMap<String, Implementation>;

#[test]
fn book_and_crates_list_the_same_equations_and_functions() {
    report(METHODS.iter().flat_map(differences).collect());
}

#[test]
fn every_equation_of_the_papers_is_in_the_book() {
    report(METHODS.iter().flat_map(|method| uncovered(method.page, method.required, &book_table(method))).collect());
}

#[test]
fn named_functions_exist() {
    report(METHODS.iter().flat_map(missing_functions).collect());
}

#[test]
fn the_table_of_smoothed_particles_agrees_with_the_methods_that_use_them() {
    let documentation = documentation(&crate_source("sph").join("lib.rs"));
    let [_, particles, _, aurora] = &METHODS;
    let (rows, mut faults) = (table_rows(&documentation), Vec::new());
    assert!(!rows.is_empty(), "bansho_sph: no table under the heading `Equations`");
    for row in rows {
        let [_, of_particles, of_aurora, function, ..] = row.as_slice() else { panic!("too few columns: {row:?}") };
        let function = in_sph(functions(function, ""));
        faults.extend(sph_row_faults(particles, of_particles, &function));
        faults.extend(sph_row_faults(aurora, of_aurora, &function));
    }
    report(faults);
}

fn report(faults: Vec<String>) {
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

/// Equations that one table lacks, or for which the tables name other functions.
fn differences(method: &Method) -> Vec<String> {
    let Method { page, .. } = method;
    let (book, code, module) = (book_table(method), crate_table(method), module_name(method));
    let mut faults = Vec::new();
    for (equation, implementation) in &book {
        match (implementation, code.get(equation)) {
            (Implementation::NotUsed, None) => {}
            (Implementation::NotUsed, Some(_)) => {
                faults.push(format!("{equation}: not used by {page}, but in {module}"));
            }
            (Implementation::By(_), None) => faults.push(format!("{equation}: in {page}, but not in {module}")),
            (_, Some(found)) if found != implementation => {
                faults.push(format!("{equation}: {implementation:?} in {page}, but {found:?} in {module}"));
            }
            _ => {}
        }
    }
    let absent = code.keys().filter(|equation| !book.contains_key(*equation));
    faults.extend(absent.map(|equation| format!("{equation}: in {module}, but not in {page}")));
    faults
}

/// Required equations that a table lacks, and numbers that the paper does not have.
fn uncovered(page: &str, required: &[&str], table: &Equations) -> Vec<String> {
    let required: BTreeSet<String> = required.iter().map(|number| format!("({number})")).collect();
    let found: BTreeSet<String> = table.keys().filter(|equation| equation.starts_with('(')).cloned().collect();
    let lacking = required.difference(&found).map(|equation| format!("{equation}: not in {page}"));
    let unknown = found.difference(&required).map(|equation| format!("{equation}: in {page}, but not in the paper"));
    lacking.chain(unknown).collect()
}

/// Functions of the book's table and of the crate's that are not in the sources.
fn missing_functions(method: &Method) -> Vec<String> {
    let mut faults = Vec::new();
    for (place, table) in [("book", book_table(method)), ("crate", crate_table(method))] {
        for (equation, implementation) in table {
            let Implementation::By(paths) = implementation else { continue };
            if paths.is_empty() {
                faults.push(format!("{equation} of {}: the {place}'s table names no function", method.page));
            }
            let absent = paths.into_iter().filter(|path| !exists(method.in_crate, path));
            faults
                .extend(absent.map(|path| format!("{equation} of {}: `{path}` ({place}) does not exist", method.page)));
        }
    }
    faults
}

/// Equations of a cell of the table of `bansho_sph` whose method names another function, and functions that do not exist.
fn sph_row_faults(method: &Method, cell: &str, function: &BTreeSet<String>) -> Vec<String> {
    let absent = function.iter().filter(|path| !exists("sph", path));
    let mut faults: Vec<String> = absent.map(|path| format!("bansho_sph: `{path}` does not exist")).collect();
    let table = book_table(method);
    for equation in equations(cell).into_iter().filter(|equation| equation.starts_with('(')) {
        let named = matches!(table.get(&equation), Some(Implementation::By(paths)) if !paths.is_disjoint(function));
        if !named {
            faults.push(format!("{equation} of {}: names none of {function:?}, as bansho_sph does", method.page));
        }
    }
    faults
}

/// The table under `## Equations` of a page.
fn book_table(method: &Method) -> Equations {
    let page = read(&Path::new(BOOK).join(method.page));
    table_of(method.page, &page, "")
}

/// The table under `# Equations` of a module's documentation; paths are relative to the module.
fn crate_table(method: &Method) -> Equations {
    table_of(&module_name(method), &documentation(&module_file(method)), method.module)
}

/// The name of that module, as in `bansho_fire::sheet`.
fn module_name(method: &Method) -> String {
    let path = ["bansho_", method.in_crate, if method.module.is_empty() { "" } else { "::" }, method.module];
    path.concat()
}

/// The file whose documentation contains the table of a method.
fn module_file(method: &Method) -> PathBuf {
    let source = crate_source(method.in_crate);
    if method.module.is_empty() { source.join("lib.rs") } else { source.join(method.module).join("mod.rs") }
}

/// The `//!` lines of a file, without their marks.
fn documentation(path: &Path) -> String {
    read(path).lines().filter_map(|line| line.strip_prefix("//!")).map(|line| format!("{}\n", line.trim())).collect()
}

/// The equations of the table in a text; a function of a module is `module` followed by its path.
fn table_of(name: &str, text: &str, module: &str) -> Equations {
    let mut table = Equations::new();
    for row in table_rows(text) {
        let [equation_cell, _, function_cell, ..] = row.as_slice() else { panic!("{name}: too few columns: {row:?}") };
        let implementation = if function_cell.starts_with("not used") {
            assert!(function_cell.starts_with("not used: "), "{name}: no reason why {equation_cell} is not used");
            Implementation::NotUsed
        } else {
            Implementation::By(functions(function_cell, module))
        };
        for equation in equations(equation_cell) {
            assert!(
                table.insert(equation.clone(), implementation.clone()).is_none(),
                "{name}: {equation} stands twice"
            );
        }
    }
    assert!(!table.is_empty(), "{name}: no table under the heading `Equations`");
    table
}

/// The cells of the first table under the heading `Equations`, without its head.
fn table_rows(text: &str) -> Vec<Vec<String>> {
    let is_heading = |line: &&str| line.starts_with('#') && line.trim_start_matches('#').trim() == "Equations";
    let section = text.lines().skip_while(|line| !is_heading(line)).skip(1);
    let table = section.take_while(|line| !line.starts_with('#')).skip_while(|line| !line.starts_with('|'));
    table.take_while(|line| line.starts_with('|')).skip(2).map(cells).collect()
}

/// The equations that a first cell names: numbers in parentheses, ranges written out, or the cell itself.
fn equations(cell: &str) -> Vec<String> {
    if !cell.starts_with('(') {
        return if cell.is_empty() { Vec::new() } else { vec![cell.to_owned()] };
    }
    cell.split(", ")
        .flat_map(|item| item.split_once(" to ").map_or(vec![item.to_owned()], |(a, b)| range(a, b)))
        .collect()
}

/// All numbers from `(2.7)` to `(2.9)`.
fn range(first: &str, last: &str) -> Vec<String> {
    let parts = |number: &str| {
        let number = number.trim_matches(['(', ')']);
        let (chapter, own) = number.rsplit_once('.').map_or(("", number), |(chapter, own)| (chapter, own));
        (chapter.to_owned(), own.parse::<u32>().unwrap_or_else(|_| panic!("`{number}` is not an equation number")))
    };
    let ((chapter, from), (_, to)) = (parts(first), parts(last));
    let prefix = if chapter.is_empty() { chapter } else { chapter + "." };
    (from..=to).map(|own| format!("({prefix}{own})")).collect()
}

/// The paths in a cell: targets of links, and code that is not the text of a link. Keys of scene files are not paths.
fn functions(cell: &str, module: &str) -> BTreeSet<String> {
    let pieces: Vec<&str> = cell.split('`').collect();
    let mut paths = BTreeSet::new();
    for (number, code) in pieces.iter().enumerate().skip(1).step_by(2) {
        let after = pieces.get(number + 1).copied().unwrap_or_default();
        let target = after.strip_prefix("](").and_then(|rest| rest.split_once(')')).map(|(target, _)| target);
        let path = target.unwrap_or(code).trim_end_matches(['(', ')']);
        if path.chars().all(|letter| letter.is_alphanumeric() || letter == '_' || letter == ':') {
            paths.insert(within(module, path));
        }
    }
    paths
}

/// A path from the root of its crate; paths in other crates stay.
fn within(module: &str, path: &str) -> String {
    if module.is_empty() || path.starts_with("bansho_") { path.to_owned() } else { format!("{module}::{path}") }
}

/// Paths of `bansho_sph` as other crates write them.
fn in_sph(paths: BTreeSet<String>) -> BTreeSet<String> {
    paths.into_iter().map(|path| format!("bansho_sph::{path}")).collect()
}

/// The checks find what is wrong.
mod faults {
    use super::*;

    #[test]
    fn a_table_gives_its_numbers_ranges_names_and_functions() {
        let text = "# Equations\n\n| equation | what it says | function |\n|---|---|---|\n\
            | (2.7) to (2.9), (3) | `a \\| b` | [`g`](render::g), `Other::h` |\n| section 5 | sum | [`f()`](f()) |\n\
            | (4) | | not used: (3) holds |\n| (6) | | with `key.of = 1`: `m` |\n\n| (5) | another table | `k` |\n";
        let table = table_of("text", text, "sheet");
        assert_eq!(table.keys().collect::<Vec<_>>(), ["(2.7)", "(2.8)", "(2.9)", "(3)", "(4)", "(6)", "section 5"]);
        let by = |paths: &[&str]| Implementation::By(paths.iter().map(|path| path.to_string()).collect());
        assert_eq!(table["(2.8)"], by(&["sheet::render::g", "sheet::Other::h"]));
        assert_eq!(table["(6)"], by(&["sheet::m"]));
        assert_eq!((&table["section 5"], &table["(4)"]), (&by(&["sheet::f"]), &Implementation::NotUsed));
    }

    #[test]
    fn equations_that_are_missing_or_not_in_the_paper_are_found() {
        let table =
            Equations::from([("(1)".to_owned(), Implementation::NotUsed), ("(3)".to_owned(), Implementation::NotUsed)]);
        let faults = uncovered("page.md", &["1", "2"], &table);
        assert_eq!(faults, ["(2): not in page.md", "(3): in page.md, but not in the paper"]);
    }

    #[test]
    fn functions_are_found_where_they_are_and_nowhere_else() {
        assert!(
            exists("fire", "sheet::equations::rise")
                && exists("fire", "bansho_sph::PressureForce::compute_accelerations")
        );
        assert!(exists("fire", "sheet::paper_texture"), "re-exported from `sheet::texture::paper`");
        assert!(!exists("fire", "sheet::equations::ris") && !exists("fire", "sheet::rise"));
        assert!(!exists("fire", "sheet::equations::Missing::rise") && !exists("fire", "bansho_sph::Poly7"));
    }
}
