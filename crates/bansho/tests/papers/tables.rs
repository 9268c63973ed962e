//! The four papers, item by item: each page of the book in `docs/src/papers` has a table of every numbered equation, figure, table and item of future work.
//! Every row names a scene, a command or a function that exists, a number, a test that measures it, and whether it is done or why not. Its numbers are those
//! of the test: `cargo test -- --nocapture` prints what was measured. A test asserts a number by `assert_measured!("figure 2.14: quantity", ...)`, under the
//! name of its row, and the row states that number.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use crate::sources::{cells, exists, has_words, read, rust_files};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// A paper, and what is numbered in it.
struct Paper {
    /// Page in `docs/src/papers`, and the folder of its scenes in `scenes/papers`.
    name: &'static str,
    /// Crate of the functions that its table names.
    in_crate: &'static str,
    /// Numbers of its equations, figures, pictures and tables: kind, then numbers and ranges.
    numbered: &'static [(&'static str, &'static str)],
    /// At least so many items of future work.
    future_work: usize,
}

const PAPERS: [Paper; 4] = [
    Paper {
        name: "ohshima_itahashi",
        in_crate: "fire",
        numbered: &[("equation", "1-7, 9-18, 20"), ("figure", "1-7"), ("picture", "1-9"), ("table", "1")],
        future_work: 5,
    },
    Paper { name: "inagaki", in_crate: "fire", numbered: &[("equation", "1-17"), ("figure", "1-10")], future_work: 0 },
    // There is no figure 2.
    Paper {
        name: "yoshida_dobashi_yamamoto",
        in_crate: "rain",
        numbered: &[("equation", "1-4"), ("figure", "1, 3-5, 6a, 6b, 7a, 7b")],
        future_work: 5,
    },
    Paper {
        name: "sekiguchi",
        in_crate: "aurora",
        numbered: &[("equation", "2.1-2.30"), ("figure", "1.1-1.3, 2.1-2.21, 3.1-3.14"), ("table", "2.1-2.4, 3.1-3.3")],
        future_work: 4,
    },
];

/// A row of a table.
struct Row {
    item: String,
    subject: String,
    measured: String,
    test: String,
    state: String,
}

#[test]
fn every_item_of_the_papers_is_in_the_book() {
    report(PAPERS.iter().flat_map(|paper| uncovered(paper, &rows(paper))).collect());
}

#[test]
fn every_row_names_what_exists_and_a_number_that_a_test_measures() {
    let tests = test_names();
    let of_paper =
        |paper: &Paper| -> Vec<String> { rows(paper).iter().flat_map(|row| faults(paper, row, &tests)).collect() };
    report(PAPERS.iter().flat_map(of_paper).collect());
}

#[test]
fn the_numbers_of_a_row_are_those_of_its_tests() {
    let files: Vec<String> = rust_files(&Path::new(ROOT).join("crates")).iter().map(|file| read(file)).collect();
    let mut faults = Vec::new();
    for paper in &PAPERS {
        for row in rows(paper) {
            let tests = code(&row.test);
            // What a command prints depends on the machine; the tests of the program run it.
            if tests.is_empty() || tests.iter().any(|test| test.starts_with("bansho ")) {
                continue;
            }
            let with_test = |test: &String| -> Vec<String> {
                files.iter().filter(|file| has_test(file, test)).map(|file| with_helpers(file, test)).collect()
            };
            let known: Vec<f64> = tests.iter().flat_map(with_test).flat_map(|source| numbers(&source)).collect();
            let missing = unknown_numbers(&row.measured, &known);
            if !missing.is_empty() {
                faults.push(format!("{}: {}: its tests do not have {missing:?}", paper.name, row.item));
            }
        }
    }
    report(faults);
}

#[test]
fn rows_state_the_values_that_tests_assert_under_their_names() {
    let files: Vec<String> = rust_files(&Path::new(ROOT).join("crates")).iter().map(|file| read(file)).collect();
    let (mut faults, mut unnamed) = (Vec::new(), BTreeSet::new());
    for paper in &PAPERS {
        for row in rows(paper).into_iter().filter(|row| row.state == "done") {
            let tests = code(&row.test);
            // What a command prints depends on the machine; the tests of the program run it.
            if tests.iter().any(|test| test.starts_with("bansho ")) {
                continue;
            }
            let mut asserted = Vec::new();
            for test in &tests {
                for file in files.iter().filter(|file| has_test(file, test)) {
                    asserted.extend(
                        assertions(&with_helpers(file, test)).into_iter().filter(|found| found.is_of(&row.item)),
                    );
                }
            }
            if asserted.is_empty() {
                unnamed.insert((paper.name, row.item.clone()));
            }
            let stated = page_numbers(&row.measured);
            for Assertion { name, value, tolerance } in asserted {
                // Of a difference that is asserted to be 0 the row states the bound.
                let shown = if value == Some(0.0) && !stated.contains(&0.0) { tolerance } else { value };
                match shown {
                    None => faults.push(format!("{}: `{name}`: its value is not a number in the source", paper.name)),
                    Some(value) if stated.iter().any(|number| is_same_number(value, *number)) => {}
                    Some(value) => {
                        faults
                            .push(format!("{}: {}: the row does not state {value} of `{name}`", paper.name, row.item));
                    }
                }
            }
        }
    }
    let listed: BTreeSet<(&str, String)> =
        WITHOUT_NAME.iter().flat_map(|(paper, items)| items.iter().map(|item| (*paper, (*item).to_owned()))).collect();
    let list = |rows: Vec<&(&str, String)>, what: &str| -> Vec<String> {
        rows.iter().map(|(paper, item)| format!("{paper}: {item}: {what}")).collect()
    };
    faults.extend(list(unnamed.difference(&listed).collect(), "no test asserts a number under its name"));
    faults.extend(list(listed.difference(&unnamed).collect(), "is listed, but has a number under its name, or no row"));
    report(faults);
}

/// Rows whose tests do not yet assert their numbers under their names, by paper. It may only become shorter.
const WITHOUT_NAME: &[(&str, &[&str])] =
    &[("inagaki", &["section 6: mouse drag"]), ("sekiguchi", &["figure 3.1", "figure 3.2", "figure 3.3"])];

/// What `assert_measured!` asserts.
#[derive(Debug, PartialEq)]
struct Assertion {
    /// `ITEM: QUANTITY`, or `ITEM & ITEM: QUANTITY`; with `{}` where it is formatted.
    name: String,
    /// The value that the book states; `None` if it is not written as a number or a constant.
    value: Option<f64>,
    /// By how much the found value may differ.
    tolerance: Option<f64>,
}

impl Assertion {
    /// Whether it is a number of the row of an item.
    fn is_of(&self, item: &str) -> bool {
        let items = self.name.rsplit_once(": ").map(|(items, _)| items);
        items.is_some_and(|items| items.split(" & ").any(|name| name == item))
    }
}

/// The assertions of numbers of the book in a source.
fn assertions(source: &str) -> Vec<Assertion> {
    let calls = source.split("assert_measured!(").skip(1);
    calls.filter_map(|call| assertion(&arguments(call), source)).collect()
}

/// The assertion with these arguments of `assert_measured!`.
fn assertion(arguments: &[&str], source: &str) -> Option<Assertion> {
    let [name, _, value, tolerance, ..] = arguments else { return None };
    let name = name.split('"').nth(1)?.to_owned();
    let literal = |text: &str| {
        let digits = text.trim_start_matches('-');
        numbers(text).first().copied().filter(|_| digits.starts_with(|letter: char| letter.is_ascii_digit()))
    };
    let constant = |name: &str| {
        let (_, declaration) = source.split_once(&format!("const {name}: f64 = "))?;
        literal(declaration.split(';').next()?)
    };
    let number = |text: &str| literal(text).or_else(|| constant(text));
    Some(Assertion { name, value: number(value), tolerance: number(tolerance) })
}

/// The arguments of a call whose text begins after its opening parenthesis.
fn arguments(call: &str) -> Vec<&str> {
    let (mut depth, mut in_text, mut start) = (0, false, 0);
    let mut arguments = Vec::new();
    for (index, letter) in call.char_indices() {
        match letter {
            '"' => in_text = !in_text,
            _ if in_text => {}
            '(' | '[' | '{' => depth += 1,
            ')' if depth == 0 => {
                arguments.push(call[start..index].trim());
                break;
            }
            ')' | ']' | '}' => depth -= 1,
            ',' if depth == 0 => {
                arguments.push(call[start..index].trim());
                start = index + 1;
            }
            _ => {}
        }
    }
    arguments
}

fn report(faults: Vec<String>) {
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

/// The rows under the heading `Everything numbered` of a page.
fn rows(paper: &Paper) -> Vec<Row> {
    let page = read(&Path::new(ROOT).join("docs/src/papers").join(paper.name).with_extension("md"));
    let section = page.lines().skip_while(|line| line.trim() != "## Everything numbered").skip(1);
    let table = section.skip_while(|line| !line.starts_with('|')).take_while(|line| line.starts_with('|'));
    let rows: Vec<Row> = table.skip(2).map(|line| row(paper.name, line)).collect();
    assert!(!rows.is_empty(), "{}: no table under the heading `Everything numbered`", paper.name);
    rows
}

fn row(page: &str, line: &str) -> Row {
    let [item, _, subject, measured, test, state] = <[String; 6]>::try_from(cells(line))
        .unwrap_or_else(|cells| panic!("{page}: six columns, not {}: {line}", cells.len()));
    Row { item, subject, measured, test, state }
}

/// Items of a paper without a row, items with two, and numbers that the paper does not have.
fn uncovered(paper: &Paper, rows: &[Row]) -> Vec<String> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    rows.iter().for_each(|row| *counts.entry(&row.item).or_default() += 1);
    let required: BTreeSet<String> = paper.numbered.iter().flat_map(|(kind, numbers)| items(kind, numbers)).collect();
    let kinds: Vec<String> = paper.numbered.iter().map(|(kind, _)| format!("{kind} ")).collect();
    let mut faults: Vec<String> = required
        .iter()
        .filter(|item| !counts.contains_key(item.as_str()))
        .map(|item| format!("{}: no row for {item}", paper.name))
        .collect();
    for (item, count) in &counts {
        let is_numbered = kinds.iter().any(|kind| item.starts_with(kind.as_str()));
        if is_numbered && !required.contains(*item) {
            faults.push(format!("{}: {item} is not in the paper", paper.name));
        }
        if *count > 1 {
            faults.push(format!("{}: {count} rows for {item}", paper.name));
        }
    }
    let future = counts.keys().filter(|item| item.starts_with("future work: ")).count();
    if future < paper.future_work {
        faults.push(format!("{}: {future} items of future work of {}", paper.name, paper.future_work));
    }
    faults
}

/// The items of a kind with these numbers: `1-3, 6a` is 1, 2, 3 and 6a; `2.1-2.3` is within a chapter.
fn items(kind: &str, numbers: &str) -> Vec<String> {
    let name =
        |number: &str| if kind == "equation" { format!("equation ({number})") } else { format!("{kind} {number}") };
    let range = |(first, last): (&str, &str)| -> Vec<String> {
        let split = |number: &str| match number.rsplit_once('.') {
            Some((chapter, own)) => (format!("{chapter}."), own.parse::<u32>().unwrap()),
            None => (String::new(), number.parse::<u32>().unwrap()),
        };
        let ((chapter, from), (_, to)) = (split(first), split(last));
        (from..=to).map(|own| name(&format!("{chapter}{own}"))).collect()
    };
    numbers.split(", ").flat_map(|part| part.split_once('-').map_or_else(|| vec![name(part)], range)).collect()
}

/// What is wrong with a row.
fn faults(paper: &Paper, row: &Row, tests: &BTreeSet<String>) -> Vec<String> {
    let fault = |what: String| format!("{}: {}: {what}", paper.name, row.item);
    let mut faults = Vec::new();
    let is_done = row.state == "done";
    let has_reason = ["not done: ", "replaced: "]
        .iter()
        .any(|start| row.state.strip_prefix(start).is_some_and(|reason| reason.len() > 10));
    if !is_done && !has_reason {
        faults.push(fault(format!("`{}` is neither done nor has a reason", row.state)));
    }
    let subjects = code(&row.subject);
    for subject in &subjects {
        if !subject_exists(paper, subject) {
            faults.push(fault(format!("`{subject}` does not exist")));
        }
    }
    if is_done && subjects.is_empty() {
        faults.push(fault("names no scene, command or function".into()));
    }
    if is_done && !row.measured.chars().any(|letter| letter.is_ascii_digit()) {
        faults.push(fault("has no number".into()));
    }
    let measured_by = code(&row.test);
    for name in measured_by.iter().filter(|name| !name.starts_with("bansho ") && !tests.contains(*name)) {
        faults.push(fault(format!("there is no test `{name}`")));
    }
    if is_done && measured_by.is_empty() {
        faults.push(fault("names no test or command that measures its number".into()));
    }
    faults
}

/// The pieces of code in a cell.
fn code(cell: &str) -> Vec<String> {
    cell.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// Whether a scene, a command with the scenes that it names, or a function exists.
fn subject_exists(paper: &Paper, subject: &str) -> bool {
    let scenes = |text: &str| text.split_whitespace().filter(|word| word.starts_with("scenes/")).all(is_scene);
    if subject.starts_with("bansho ") {
        let command = subject.split_whitespace().nth(1).unwrap_or_default();
        return scenes(subject) && has_words(&read(&Path::new(ROOT).join("docs/src/guide/program.md")), command);
    }
    if subject.starts_with("scenes/") {
        return is_scene(subject);
    }
    // Keys and values of scene files are no paths.
    if !subject.contains("::") {
        return true;
    }
    exists(paper.in_crate, subject)
}

/// Whether a path from the root is that of a scene.
fn is_scene(path: &str) -> bool {
    Path::new(ROOT).join(path).is_file()
}

/// The numbers of a text that are not among the known ones, nor their percentages.
fn unknown_numbers(text: &str, known: &[f64]) -> Vec<f64> {
    let is_known = |number: &f64| known.iter().any(|known| is_same_number(*known, *number));
    page_numbers(text).into_iter().filter(|number| !is_known(number)).collect()
}

/// Whether a number of a page is that of a test, or its percentage.
fn is_same_number(in_test: f64, on_page: f64) -> bool {
    [1.0, 100.0, 0.01].iter().any(|unit| (in_test.abs() * unit - on_page).abs() < 1e-9 * on_page.max(1.0))
}

/// The numbers of a page's text. Code, powers and numbers of equations in parentheses do not count.
fn page_numbers(text: &str) -> Vec<f64> {
    let prose: String = text.split('`').step_by(2).collect();
    let is_equation = |part: &str| part.chars().all(|letter| letter.is_ascii_digit() || letter == '.');
    let prose: Vec<&str> = prose.split(['(', ')']).filter(|part| !is_equation(part)).collect();
    // Thousands are separated by commas.
    let letters: Vec<char> = prose.join(" ").chars().collect();
    let is_digit = |index: usize| letters.get(index).is_some_and(char::is_ascii_digit);
    let is_separator = |index: usize| letters[index] == ',' && index > 0 && is_digit(index - 1) && is_digit(index + 1);
    let prose: String = (0..letters.len()).filter(|index| !is_separator(*index)).map(|index| letters[index]).collect();
    numbers(&prose)
}

/// The numbers of a text, without their signs; not those within words.
fn numbers(text: &str) -> Vec<f64> {
    // The ends of a range.
    let text = text.replace("..", " .. ");
    let is_part_of_word = |letter: char| letter.is_alphanumeric() || "._-".contains(letter);
    let words = text.split(|letter: char| !is_part_of_word(letter)).map(|word| word.trim_matches(['-', '.', '_']));
    let words = words.filter(|word| word.starts_with(|letter: char| letter.is_ascii_digit()));
    words.filter_map(|word| word.replace('_', "").parse().ok()).collect()
}

/// Whether a source has a function of that name.
fn has_test(source: &str, name: &str) -> bool {
    source.contains(&format!("fn {name}()"))
}

/// The test of that name in a source, with the functions and constants of the source that it names, and those that these name.
fn with_helpers(source: &str, test: &str) -> String {
    let items = named_items(source);
    let (mut names, mut next) = (vec![test], 0);
    let mut text = String::new();
    while let Some(name) = names.get(next) {
        let item = items.get(name).copied().unwrap_or_default();
        text.push_str(item);
        text.push('\n');
        for word in item.split(|letter: char| !letter.is_alphanumeric() && letter != '_') {
            if items.contains_key(word) && !names.contains(&word) {
                names.push(word);
            }
        }
        next += 1;
    }
    text
}

/// The functions and constants of a source by their names: from the line that declares them to the one that closes them, at the same indentation.
fn named_items(source: &str) -> BTreeMap<&str, &str> {
    let mut items = BTreeMap::new();
    let mut start = 0;
    for line in source.split_inclusive('\n') {
        let rest = &source[start..];
        let declaration = line.trim_start();
        let indent = &line[..line.len() - declaration.len()];
        let declaration =
            declaration.trim_start_matches("pub(crate) ").trim_start_matches("pub(super) ").trim_start_matches("pub ");
        for (keyword, end) in [("fn ", format!("\n{indent}}}")), ("const ", ";\n".to_owned())] {
            if let Some(name) = declaration.strip_prefix(keyword) {
                let name =
                    name.split(|letter: char| !letter.is_alphanumeric() && letter != '_').next().unwrap_or_default();
                let length = rest.find(&end).unwrap_or(rest.len());
                items.insert(name, &rest[..length]);
            }
        }
        start += line.len();
    }
    items
}

/// The names of all functions with the attribute `#[test]`.
fn test_names() -> BTreeSet<String> {
    let files: Vec<PathBuf> = rust_files(&Path::new(ROOT).join("crates"));
    let of_file = |file: &PathBuf| -> Vec<String> {
        let source = read(file);
        let after = source.split("#[test]").skip(1);
        after.filter_map(|rest| Some(rest.split_once("fn ")?.1.split_once('(')?.0.to_owned())).collect()
    };
    files.iter().flat_map(of_file).collect()
}

/// The checks find what is wrong.
mod checks {
    use super::*;

    fn of(line: &str) -> Vec<String> {
        let tests = BTreeSet::from(["a_test".to_owned()]);
        faults(&PAPERS[3], &row("page", line), &tests)
    }

    #[test]
    fn a_good_row_has_no_fault_and_each_missing_thing_is_one() {
        let scene = "`scenes/sekiguchi_1.toml`";
        assert!(of(&format!("| figure 1 | a | {scene} | 3 km | `a_test` | done |")).is_empty());
        assert!(of("| figure 1 | a | | | | not done: it is a photograph |").is_empty());
        for (line, expected) in [
            (format!("| figure 1 | a | {scene} | some | `a_test` | done |"), "has no number"),
            (format!("| figure 1 | a | {scene} | 3 km | `other` | done |"), "there is no test `other`"),
            (format!("| figure 1 | a | {scene} | 3 km | | done |"), "names no test"),
            (format!("| figure 1 | a | {scene} | 3 km | `a_test` | nearly |"), "neither done nor has a reason"),
            ("| figure 1 | a | | 3 km | `a_test` | done |".to_owned(), "names no scene"),
            ("| figure 1 | a | `scenes/none.toml` | 3 km | `a_test` | done |".to_owned(), "does not exist"),
            ("| figure 1 | a | `simulate::none` | 3 km | `a_test` | done |".to_owned(), "does not exist"),
            ("| figure 1 | a | `bansho plit x` | 3 km | `a_test` | done |".to_owned(), "does not exist"),
        ] {
            let found = of(&line);
            assert!(found.len() == 1 && found[0].contains(expected), "{line}: {found:?}");
        }
    }

    #[test]
    fn numbers_that_no_test_has_are_found() {
        let source = "const SIZE: usize = 1_280;\nfn helper() {\n    0.5\n}\n#[test]\nfn a_test() {\n    for i in 0..240 {\n        helper() + 1e-4 + 0.89;\n        SIZE;\n    }\n}\nfn other() {\n    7\n}\n";
        assert!(has_test(source, "a_test") && !has_test(source, "b_test"));
        let known = numbers(&with_helpers(source, "a_test"));
        assert_eq!(known, [0.0, 240.0, 1e-4, 0.89, 0.5, 1280.0]);
        let unknown = |text: &str| unknown_numbers(text, &known);
        assert_eq!(unknown("1,280 pixels, 89 % and 0.5 of 240, within 1e-4 by (2.25) and `n = 3`"), [0.0; 0]);
        assert_eq!(unknown("-7 km, 0.6 or T1"), [7.0, 0.6]);
    }

    #[test]
    fn assertions_are_read_with_their_names_and_values() {
        let source = "const WIDE: f64 = 1_280.0;\nassert_measured!(\"figure 1 & table 2: width, m\", f(a, [b, c]), -0.5, 1e-3);\n\
                      bansho_base::assert_measured!(format!(\"figure 1: {name}\"), x, WIDE, 0.0);\nassert_measured!(\"a\", x, stated, 0.0);\n";
        let found = assertions(source);
        let values: Vec<Option<f64>> = found.iter().map(|assertion| assertion.value).collect();
        assert_eq!(values, [Some(0.5), Some(1280.0), None]);
        assert_eq!(found[0].tolerance, Some(1e-3));
        let of = |item: &str| found.iter().map(|assertion| assertion.is_of(item)).collect::<Vec<_>>();
        assert_eq!(of("figure 1"), [true, true, false]);
        assert_eq!(of("table 2"), [true, false, false]);
        assert_eq!(of("figure 12"), [false; 3]);
        assert!(is_same_number(0.97, 97.0) && is_same_number(-7.0, 7.0) && !is_same_number(0.97, 98.0));
    }

    #[test]
    fn items_are_written_out() {
        assert_eq!(items("equation", "2.9-2.10"), ["equation (2.9)", "equation (2.10)"]);
        assert_eq!(items("figure", "1, 6a"), ["figure 1", "figure 6a"]);
    }
}
