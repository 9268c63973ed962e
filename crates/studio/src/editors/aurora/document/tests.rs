use std::sync::Arc;

use bansho::{Assets, MemoryAssets, aurora::shapes::Form, base::math::DVec2};

use super::{AuroraDrawing, Factor, LinkedPoint, ShapeEditError, SheetPosition, StrokeEnd};
use crate::document::Document;

const ARC: &str = "\
bansho = 2
[[aurora]]
extent_km = 800.0 # wide
[[aurora.shapes]]
sheets = [{ points = [[-200, 0], [0, 0], [200, 0]] }] # the arc
";

fn assets() -> Arc<dyn Assets> {
    Arc::new(MemoryAssets::default())
}

fn open(text: &str) -> (Document, AuroraDrawing) {
    let document = Document::new("aurora", text);
    let drawing = AuroraDrawing::read(document.values(), 0, &assets()).unwrap();
    (document, drawing)
}

fn change(document: &mut Document, operations: &[bansho::scene::operation::Operation]) -> AuroraDrawing {
    document.edit_shapes("change", operations, 0, &assets()).unwrap()
}

fn stroke(points: &[[f64; 2]]) -> Vec<DVec2> {
    points.iter().map(|&point| DVec2::from(point)).collect()
}

fn at(sheet: usize, fraction: f64) -> SheetPosition {
    SheetPosition { sheet, fraction }
}

fn end(sheet: usize, last: bool) -> StrokeEnd {
    StrokeEnd { sheet, last }
}

fn is_valid(document: &mut Document) -> bool {
    document.check_now(&assets());
    document.error().is_none()
}

#[test]
fn strokes_add_and_replace_sheets() {
    let (mut document, drawing) = open("bansho = 2\n[[aurora]]\n");
    assert!(!drawing.is_stated() && drawing.arrivals() == [0.0]);
    let drawing = change(&mut document, &drawing.draw(0, None, &stroke(&[[-100.0, 0.0], [0.0, 0.04], [100.0, 0.0]])));
    let drawing = change(&mut document, &drawing.draw(0, None, &stroke(&[[-100.0, 50.0], [100.0, 50.0]])));
    assert!(document.text().contains("points = [[-100.0, 0.0], [100.0, 0.0]]"), "{}", document.text());
    let drawing = change(&mut document, &drawing.draw(0, Some(1), &stroke(&[[-100.0, -50.0], [100.0, -50.0]])));
    assert_eq!(drawing.lines(0).len(), 2);
    assert_eq!(drawing.points(0, 1), stroke(&[[-100.0, -50.0], [100.0, -50.0]]));
    assert!(is_valid(&mut document));
}

#[test]
fn invalid_strokes_are_refused_with_the_scenes_error() {
    let (mut document, drawing) = open(ARC);
    let across = drawing.draw(0, None, &stroke(&[[0.0, -100.0], [0.0, 100.0]]));
    let shape_error = document.edit_shapes("draw", &across, 0, &assets()).unwrap_err();
    assert!(shape_error.to_string().starts_with("shape 1: sheet 2 meets sheet 1"), "{shape_error}");
    assert_eq!(**document.text(), *ARC);
    assert!(matches!(AuroraDrawing::read(document.values(), 1, &assets()), Err(ShapeEditError::Missing)));
}

#[test]
fn a_split_cuts_the_sheets_of_later_shapes() {
    let (mut document, drawing) = open(ARC);
    let drawing = change(&mut document, &drawing.add_shape());
    let bent = stroke(&[[-200.0, 100.0], [0.0, 60.0], [200.0, 100.0]]);
    let drawing = change(&mut document, &drawing.draw(1, Some(0), &bent));
    let drawing = change(&mut document, &drawing.split(1, 0, 0.5));
    assert_eq!([drawing.lines(0).len(), drawing.lines(1).len()], [1, 2]);
    assert_eq!(drawing.point_paths(0).len(), 2);
    let ends = [drawing.points(1, 0), drawing.points(1, 1)];
    assert!(ends[0].last().unwrap().x < -5.0 && ends[1].first().unwrap().x > 5.0, "{ends:?}");
    assert!((ends[0].last().unwrap().y - 60.0).abs() < 2.0, "{ends:?}");
    assert!(document.text().contains("# the arc") && document.text().contains("# wide"), "{}", document.text());
    let twice = drawing.split(1, 0, 0.5);
    let shape_error = document.edit_shapes("split", &twice, 0, &assets()).unwrap_err();
    assert!(shape_error.to_string().contains("split already"), "{shape_error}");
    assert!(is_valid(&mut document));
}

#[test]
fn two_ends_merge_and_a_ring_is_refused() {
    let (mut document, drawing) = open(ARC);
    let drawing = change(&mut document, &drawing.draw(0, None, &stroke(&[[220.0, 60.0], [-200.0, 60.0]])));
    let drawing = change(&mut document, &drawing.add_shape());
    let merge = drawing.merge(1, [end(0, true), end(1, false)]);
    let drawing = change(&mut document, &merge);
    assert_eq!(drawing.lines(1).len(), 1);
    let points = drawing.points(1, 0);
    assert_eq!((points[0], points[points.len() - 1]), (DVec2::new(-200.0, 0.0), DVec2::new(-200.0, 60.0)));
    let shape_error =
        document.edit_shapes("merge", &drawing.merge(1, [end(0, false), end(1, true)]), 0, &assets()).unwrap_err();
    assert!(shape_error.to_string().contains("ring"), "{shape_error}");
    assert!(is_valid(&mut document));
}

#[test]
fn forms_are_replaced_by_their_moved_points() {
    let (mut document, drawing) = open(ARC);
    let drawing = change(&mut document, &drawing.put_form(0, Some(0), Form::SShape));
    assert!(document.text().contains("sheets = [{ form = \"s_shape\" }]"), "{}", document.text());
    let mut points = drawing.points(0, 0);
    assert!((5..60).contains(&points.len()), "{}", points.len());
    points[0].y += 10.0;
    let drawing = change(&mut document, &drawing.set_points(0, 0, &points));
    assert!(!document.text().contains("form ="));
    assert!((drawing.points(0, 0)[0].y - points[0].y).abs() < 0.1);
}

#[test]
fn brightness_is_painted_under_the_brush() {
    let (mut document, drawing) = open(ARC);
    let drawing = change(&mut document, &drawing.paint(0, 0, Factor::Flux, 0.25, 1.0));
    assert!(document.text().contains("flux_factor = [[0.0, 1.0]"), "{}", document.text());
    let drawing = change(&mut document, &drawing.paint(0, 0, Factor::Energy, 0.75, -0.5));
    let mut sheets = drawing.sheets(0);
    assert_eq!(Factor::Flux.of(&mut sheets[0]).eval(0.25), 2.0);
    assert_eq!(Factor::Energy.of(&mut sheets[0]).eval(0.75), 0.5);
    assert_eq!(Factor::Flux.of(&mut sheets[0]).eval(0.75), 1.0);
}

#[test]
fn shapes_are_added_timed_and_removed() {
    let (mut document, drawing) = open("bansho = 2\n[[aurora]]\n");
    let drawing = change(&mut document, &drawing.add_shape());
    assert_eq!(drawing.arrivals().len(), 2);
    let drawing = change(&mut document, &drawing.retime(1, 2.5));
    assert_eq!((drawing.arrivals()[1], drawing.transition_s(1)), (2.5, 2.5));
    let drawing = change(&mut document, &drawing.remove_shape(1));
    assert_eq!(drawing.arrivals().len(), 1);
    assert!(is_valid(&mut document));
    // A shape after a split that becomes the first one has no transition.
    let drawing = change(&mut document, &drawing.add_shape());
    let drawing = change(&mut document, &drawing.retime(1, 2.5));
    let drawing = change(&mut document, &drawing.split(1, 0, 0.4));
    let drawing = change(&mut document, &drawing.remove_shape(0));
    assert_eq!(drawing.arrivals(), [0.0]);
    assert!(is_valid(&mut document) && !document.text().contains("transition_s"), "{}", document.text());
}

#[test]
fn sheets_and_points_are_linked() {
    let (mut document, drawing) = open(ARC);
    let drawing = change(&mut document, &drawing.draw(0, None, &stroke(&[[-200.0, 60.0], [200.0, 60.0]])));
    let drawing = change(&mut document, &drawing.add_shape());
    let drawing = change(&mut document, &drawing.add_shape());
    let exchanged = change(&mut document, &drawing.link_sheet(1, at(0, 0.3), 1));
    assert!(document.text().contains("link = [{ from = 1, to = 2 }]"), "{}", document.text());
    let crosses = |drawing: &AuroraDrawing, shape: usize| {
        drawing.point_paths(shape)[0].iter().all(|[from, to]| (to.y - from.y).abs() > 59.0)
    };
    assert!(crosses(&exchanged, 0) && !crosses(&exchanged, 1), "only that transition goes otherwise");
    let back = change(&mut document, &exchanged.link_sheet(1, at(0, 0.3), 0));
    assert!(!crosses(&back, 0));

    let moved = change(&mut document, &back.link_point(1, at(0, 0.25), at(0, 0.5)));
    let LinkedPoint { from, to, .. } = moved.linked_points(1)[0];
    assert!((from.x + 100.0).abs() < 1e-6 && to.x.abs() < 1e-6, "{from} {to}");
    let arrives = |drawing: &AuroraDrawing, from: f64| {
        let point_paths = drawing.point_paths(0).concat();
        point_paths
            .iter()
            .filter(|path| path[0].y.abs() < 1.0)
            .map(|path| ((path[0].x - from).abs(), path[1].x))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap()
            .1
    };
    assert!(arrives(&moved, -100.0).abs() < 5.0, "{}", arrives(&moved, -100.0));
    let again = change(&mut document, &moved.link_point(1, at(0, 0.26), at(0, 0.4)));
    assert_eq!(again.linked_points(1).len(), 1, "the same point is linked anew: {}", document.text());
    let unlinked = change(&mut document, &again.unlink(1, DVec2::new(-40.0, 0.0), 5.0));
    assert!(unlinked.linked_points(1).is_empty() && (arrives(&unlinked, -100.0) + 100.0).abs() < 5.0);
    assert!(is_valid(&mut document));
}

/// Three sheets from west to east.
const THREE: &str = "sheets = [{ points = [[-200, 0], [200, 0]] }, { points = [[-200, 80], [200, 80]] }, \
                     { points = [[-200, 160], [200, 160]] }]";

/// Three sheets of which the last two change places, then the middle one is split; `rest` follows.
fn exchanged_then_split(rest: &str) -> String {
    format!(
        "\
bansho = 2
[[aurora]]
extent_km = 800.0
[[aurora.shapes]]
{THREE}
[[aurora.shapes]] # in the middle
{THREE}
link = [{{ from = 2, to = 3 }}, {{ from = 3, to = 2 }}]
[[aurora.shapes]]
sheets = [{{ points = [[-200, 0], [200, 0]] }}, {{ points = [[-200, 80], [-10, 80]] }}, {{ points = [[10, 80], [200, 80]] }}, \
{{ points = [[-200, 160], [200, 160]] }}]
split = [{{ sheet = 2, length_fraction = 0.5 }}]
{rest}"
    )
}

#[test]
fn references_to_sheets_are_renumbered() {
    let text =
        &exchanged_then_split("link = [{ from = 3, to = 4, from_length_fraction = 0.5, to_length_fraction = 0.25 }]\n");
    let (document, drawing) = open(text);
    let after = |operations: &[bansho::scene::operation::Operation]| {
        let mut document = Document::new("aurora", document.text().clone());
        change(&mut document, operations);
        assert!(is_valid(&mut document), "{}", document.text());
        document.text().to_string()
    };
    let cut = after(&drawing.split(1, 0, 0.5));
    assert!(cut.contains("link = [{ from = 2, to = 4 }, { from = 3, to = 3 }]"), "{cut}");
    assert!(cut.contains("split = [{ sheet = 3, length_fraction = 0.5 }]"), "{cut}");
    assert!(
        cut.contains("link = [{ from = 4, to = 5, from_length_fraction = 0.5, to_length_fraction = 0.25 }]"),
        "{cut}"
    );
    assert_eq!(cut.matches("sheets = ").count(), 3, "{cut}");
    let linked = after(&drawing.split(1, 1, 0.5));
    assert!(
        linked.contains("link = [{ from = 2, to = 3, from_length_fraction = 0.25 }, { from = 3, to = 2 }]"),
        "{linked}"
    );
}

#[test]
fn a_sheet_is_removed_with_the_sheets_that_only_it_becomes() {
    let text =
        &exchanged_then_split(&format!("[[aurora.shapes]]\n{THREE}\nmerge = [{{ sheets = [2, 3], ends = [1, 0] }}]\n"));
    let counts_after = |shape: usize, sheet: usize| {
        let (mut document, drawing) = open(text);
        let drawing = change(&mut document, &drawing.remove_sheet(shape, sheet));
        assert!(is_valid(&mut document), "{}", document.text());
        assert!(document.text().contains("# in the middle"));
        ([0, 1, 2, 3].map(|shape| drawing.lines(shape).len()), document.text().to_string())
    };
    let (counts, first) = counts_after(1, 0);
    assert_eq!(counts, [2, 2, 3, 2], "it goes from end to end: {first}");
    assert!(first.contains("link = [{ from = 1, to = 2 }, { from = 2, to = 1 }]"), "{first}");
    assert!(first.contains("split = [{ sheet = 1, length_fraction = 0.5 }]"), "{first}");
    assert!(first.contains("merge = [{ sheets = [1, 2], ends = [1, 0] }]"), "{first}");
    let (counts, middle) = counts_after(1, 1);
    assert_eq!(counts, [2, 2, 2, 2], "both of its parts go, and what they grow together to: {middle}");
    assert!(!middle.contains("split") && !middle.contains("merge"), "{middle}");
    let (counts, part) = counts_after(2, 2);
    assert_eq!(counts, [3, 3, 3, 3], "a part goes alone: {part}");
    assert!(!part.contains("split") && !part.contains("merge") && part.contains("link = "), "{part}");
}

#[test]
fn painted_factors_survive_an_edit_of_a_sheet_with_copies() {
    let shapes = "\
bansho = 2
[[aurora]]
extent_km = 800.0
[[aurora.shapes]]
sheets = [
  { points = [[-200, 0], [200, 0]], copies = 2, spacing_km = 80.0, flux_factor = [[0.0, 0.5], [1.0, 3.0]], energy_factor = [[0.0, 2.0]] }, # a pair
]
";
    let (mut document, drawing) = open(shapes);
    let before = [0, 1].map(|sheet| [Factor::Flux, Factor::Energy].map(|factor| drawing.factors(0, sheet, factor)));
    let moved = stroke(&[[-200.0, -60.0], [200.0, -40.0]]);
    let drawing = change(&mut document, &drawing.set_points(0, 0, &moved));
    assert_eq!(drawing.lines(0).len(), 2);
    for (sheet, [flux, energy]) in before.iter().enumerate() {
        for (factor, old) in [(Factor::Flux, flux), (Factor::Energy, energy)] {
            let new = drawing.factors(0, sheet, factor);
            let ends = |all: &[f64]| [all[0], all[all.len() / 2], all[all.len() - 1]];
            let off = ends(old).iter().zip(ends(&new)).map(|(old, new)| (old - new).abs()).fold(0.0, f64::max);
            assert!(off < 0.05, "{factor:?} of sheet {sheet}: {off}\n{}", document.text());
        }
    }
    assert!(document.text().contains("# a pair"), "{}", document.text());
    assert!(is_valid(&mut document));
}

#[test]
fn list_items_keep_their_comments_when_others_are_added_or_removed() {
    let shapes = "\
bansho = 2
[[aurora]]
extent_km = 800.0
[[aurora.shapes]]
sheets = [
  { points = [[-200, 0], [200, 0]] }, # the first
  { points = [[-200, 80], [200, 80]] }, # the second
  { points = [[-200, 160], [200, 160]] }, # the third
]
";
    let (mut document, drawing) = open(shapes);
    let drawing = change(&mut document, &drawing.draw(0, None, &stroke(&[[-200.0, 240.0], [200.0, 240.0]])));
    assert_eq!(drawing.lines(0).len(), 4);
    let text = document.text().to_string();
    assert!(["# the first", "# the second", "# the third"].iter().all(|comment| text.contains(comment)), "{text}");
    change(&mut document, &drawing.remove_sheet(0, 1));
    let line = |words: &str| document.text().lines().find(|line| line.contains(words)).unwrap_or_default().to_owned();
    assert!(
        line("# the first").contains("[200, 0]") && line("# the third").contains("[200, 160]"),
        "{}",
        document.text()
    );
}
