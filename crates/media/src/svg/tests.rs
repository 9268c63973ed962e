use super::*;

fn decoded(text: &str) -> Drawing {
    decode_drawing(text.as_bytes()).unwrap_or_else(|error| panic!("{text}: {error}"))
}

fn error(text: &str) -> String {
    decode_drawing(text.as_bytes()).unwrap_err().to_string()
}

/// Names and points of the strokes.
fn strokes(text: &str) -> Vec<(Option<String>, Vec<[f64; 2]>)> {
    let points = |points: &[DVec2]| points.iter().map(|point| point.to_array()).collect();
    decoded(text).strokes.iter().map(|stroke| (stroke.id.clone(), points(&stroke.points))).collect()
}

fn expect(text: &str, expected: &[(&str, &[[f64; 2]])]) {
    let found = strokes(text);
    assert_eq!(found.len(), expected.len(), "{text}: {found:?}");
    for ((name, points), (wanted_name, wanted)) in found.iter().zip(expected) {
        assert_eq!(name.as_deref().unwrap_or_default(), *wanted_name, "{text}");
        let is_near = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]).abs() < 1e-4 && (a[1] - b[1]).abs() < 1e-4;
        assert!(points.len() == wanted.len() && points.iter().zip(*wanted).all(is_near), "{text}: {points:?}");
    }
}

#[test]
fn strokes_stand_where_their_groups_put_them() {
    let text = r#"<?xml version="1.0"?>
        <svg xmlns="http://www.w3.org/2000/svg" viewBox="-10 0 20 40" width="5cm">
          <defs><path d="M0 0L9 9"/></defs>
          <g transform="translate(1 2)" id="both">
            <path id="left" transform="scale(2)" d="M0 0L1 1"/>
            <polyline points="0,0 1,0 1,1"/>
            <g style="fill:none; display : none"><line x2="1" y2="1"/></g>
          </g>
          <line id="right" x1="1" y1="2" x2="3" y2="4"/>
          <circle r="3"/>
        </svg>"#;
    let lines: [(&str, &[[f64; 2]]); 3] = [
        ("left", &[[1.0, 2.0], [3.0, 4.0]]),
        ("both", &[[1.0, 2.0], [2.0, 2.0], [2.0, 3.0]]),
        ("right", &[[1.0, 2.0], [3.0, 4.0]]),
    ];
    expect(text, &lines);
    let drawing = decoded(text);
    assert_eq!((drawing.min, drawing.max), (DVec2::new(-10.0, 0.0), DVec2::new(10.0, 40.0)));
}

#[test]
fn uses_style_sheets_units_and_nested_coordinates_are_those_of_a_browser() {
    let line: &[[f64; 2]] = &[[5.0, 5.0], [6.0, 5.0]];
    let svg = |inner: &str| format!("<svg viewBox='0 0 100 100' width='900' height='10'>{inner}</svg>");
    let defs = "<defs><path id='arc' d='M0 0H1'/></defs>";
    expect(&svg(&format!("{defs}<use id='left' href='#arc' x='5' y='5'/>")), &[("left", line)]);
    expect(&svg(&format!("{defs}<g id='all'><use href='#arc' transform='translate(5 5)'/></g>")), &[("all", line)]);
    expect(&svg("<style>.off{display:none}</style><path class='off' d='M0 0H9'/><path d='M5 5h1'/>"), &[("", line)]);
    expect(&svg("<path visibility='hidden' d='M0 0H9'/><path fill='none' stroke='none' d='M5 5h1'/>"), &[("", line)]);
    expect(&svg("<line x1='5%' y1='5%' x2='6%' y2='5'/>"), &[("", line)]);
    expect(&svg("<svg x='5' y='5' width='10' height='10' viewBox='0 0 10 10'><path d='M0 0h1'/></svg>"), &[("", line)]);
    expect(&svg("<switch><g systemLanguage='xx'><path d='M0 0H9'/></g><path d='M5 5h1'/></switch>"), &[("", line)]);
    expect(&svg("<path d='M5 5h1' style='clip-path:url(#none);mask:url(#x);marker-end:url(#arrow)'/>"), &[("", line)]);
    let turned = "<path transform-origin='5 5' transform='rotate(180)' d='M5 5h-1'/>";
    expect(&svg(turned), &[("", line)]);
    let millimeters: &[[f64; 2]] = &[[0.0, 0.0], [96.0, 0.0]];
    expect("<svg width='30mm' height='20mm'><line x2='25.4mm'/></svg>", &[("", millimeters)]);
}

#[test]
fn without_a_view_box_the_strokes_say_what_was_drawn_on() {
    for text in ["<svg><path d='M1 2L5 4'/></svg>", "<svg width='30' height='90'><path d='M1 2L5 4'/></svg>"] {
        let drawing = decoded(text);
        assert_eq!((drawing.min, drawing.max), (DVec2::new(1.0, 2.0), DVec2::new(5.0, 4.0)), "{text}");
    }
}

#[test]
fn curves_and_arcs_stay_on_their_circle() {
    let drawing = decoded("<svg viewBox='0 0 9 9'><path d='M4 2A2 2 0 0 1 2 4'/><path d='M0 0Q1 2 2 0'/></svg>");
    let [arc, curve] = &drawing.strokes[..] else { panic!() };
    let radius = |point: &DVec2| point.distance(DVec2::splat(2.0));
    assert!(arc.points.iter().all(|point| (radius(point) - 2.0).abs() < 2e-3), "{arc:?}");
    assert_eq!((curve.points.len(), curve.points[8]), (17, DVec2::new(1.0, 1.0)));
}

#[test]
fn a_path_that_is_a_dot_is_left_out_and_the_rest_drawn() {
    expect(
        "<svg viewBox='0 0 9 9'><path d='M1 1'/><path d='M2 2z'/><path d='M3 3H4'/></svg>",
        &[("", &[[3.0, 3.0], [4.0, 3.0]])],
    );
}

#[test]
fn what_is_left_out_is_told_once() {
    use bansho_base::geometry::strokes::DrawingRemark::{Dots, OtherElements};
    let defs = "<defs><circle r='1'/><path d='M1 1'/></defs>";
    let drawing = decoded(&format!(
        "<svg>{defs}<rect/><path d='M1 1'/><path d='m2 2h0z'/><text/><rect/><path d='M3 3H4'/></svg>"
    ));
    assert_eq!(drawing.remarks, [OtherElements { names: vec!["rect", "text"] }, Dots { paths: 2 }]);
    assert_eq!(drawing.remarks[1].to_string(), "2 paths with only one point are ignored");
    let plain =
        decoded("<svg><defs><path id='a' d='M0 0H1'/></defs><use href='#a'/><path d='M0 0c1 1 2 2 0 0'/></svg>");
    assert_eq!((plain.remarks.len(), plain.strokes.len()), (0, 2));
}

#[test]
fn faults_name_their_path_and_their_line() {
    assert!(error("<svg>\n<path id='arc' d='M0 0L1'/></svg>").contains("path `arc` in line 2: its path data: "));
    assert!(error("<svg><path d='M0 0L1 1'/><path d='M0 0L1'/></svg>").contains("path after 1 strokes in line 1: "));
    assert!(
        error(&format!("<svg><path d='M0 0L1 1{}'/></svg>", "Z".repeat(100_000)))
            .contains("more than 100 times in a row")
    );
    assert!(error("<svg><path d='M0 0L1e300 1'/></svg>").contains("infinitely far away"));
    assert!(error("<svg><polyline points='0 0 1'/></svg>").contains("its points have 3 numbers; allowed: pairs"));
    assert!(error("<svg><polygon points='0 0 x 1'/></svg>").contains("its points: "));
    assert!(
        error("<svg><g id='all' transform='turn(3)'/></svg>")
            .contains("g `all` in line 1: its transform cannot be read")
    );
    for view in ["", "0 0 10", "0 0 10 0", "0 0 -3 4", "0 0 wide 3", "0 0 1 2 3"] {
        let shown = error(&format!("<svg viewBox='{view}'><path d='M0 0L1 1'/></svg>"));
        assert!(shown.contains(&format!("its viewBox is `{view}`")), "{shown}");
    }
}

#[test]
fn what_holds_no_strokes_is_refused() {
    for (text, instead) in [
        ("<svg><path/></svg>", vec![]),
        ("<svg><circle r='1'/></svg>", vec!["circle"]),
        ("<svg><defs><rect/></defs><use href='#a'/><text>A</text><use/></svg>", vec!["use", "text"]),
    ] {
        assert_eq!(decode_drawing(text.as_bytes()), Err(AssetProblem::NoStrokes { instead }), "{text}");
    }
    for broken in ["", "<html/>", "<svg", "<svg><path d='M1'/></svg>", "<svg transform='x'/>", "</svg></svg>", "plain"]
    {
        assert!(matches!(decode_drawing(broken.as_bytes()), Err(AssetProblem::Damaged(_))), "{broken}");
    }
}

#[test]
fn what_would_take_too_long_is_refused_before_it_is_resolved() {
    let begun = std::time::Instant::now();
    let uses = "<use href='#a'/>".repeat(5000);
    let path = format!("<path id='a' d='M0 0{}'/>", "L1 1".repeat(1000));
    assert!(error(&format!("<svg>{path}{uses}</svg>")).contains("more than 1000000 points"));
    let doubled: String =
        (1..40).map(|n| format!("<g id='g{n}'><use href='#g{0}'/><use href='#g{0}'/></g>", n - 1)).collect();
    assert!(
        error(&format!("<svg><defs><path id='g0' d='M0 0H1'/>{doubled}</defs><use href='#g39'/></svg>"))
            .contains("points")
    );
    assert!(error("<svg><g id='a'><use href='#a'/></g><path d='M0 0H1'/></svg>").contains("use themselves"));
    let deep = format!("<svg>{}<path d='M0 0H1'/>{}</svg>", "<g>".repeat(100_000), "</g>".repeat(100_000));
    assert!(error(&deep).contains("deep"));
    assert!(begun.elapsed().as_secs_f64() < 5.0, "{:?}", begun.elapsed());
}

#[test]
fn strokes_far_from_the_page_are_moved_and_refused_where_single_precision_would_bend_them() {
    // Meters of a national grid, to the millimeter.
    let (x, y) = (512_345.678, 4_712_345.123);
    let text = format!(
        "<svg viewBox='{x} {y} 9 9'><path id='a' d='m{x} {y}l1 0 0 1.5H{} v1 q1 1 2 0 A1 2 10 0 1 {} {}z'/>\
         <polyline points='{x},{y} {} {}'/><line x1='{x}' y1='{y}' x2='{}' y2='{y}'/></svg>",
        x + 0.25,
        x + 3.0,
        y + 0.5,
        x + 0.125,
        y + 1.0,
        x + 7.0
    );
    let drawing = decoded(&text);
    assert!(drawing.min.distance(DVec2::new(x, y)) < 1e-9 && drawing.max.distance(DVec2::new(x + 9.0, y + 9.0)) < 1e-9);
    let expected = [
        [[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]],
        [[0.0, 0.0], [0.125, 1.0], [0.125, 1.0]],
        [[0.0, 0.0], [7.0, 0.0], [7.0, 0.0]],
    ];
    for (stroke, expected) in drawing.strokes.iter().zip(expected) {
        let points = [0, 1, stroke.points.len() - 1].map(|index| stroke.points[index] - drawing.min);
        for (found, expected) in points.iter().zip(expected) {
            assert!(found.distance(expected.into()) < 1e-5, "{found} is not {expected:?}");
        }
    }
    let arc_end = DVec2::new(3.0, 0.5);
    assert!(drawing.strokes[0].points.iter().any(|point| (*point - drawing.min).distance(arc_end) < 1e-5));
    let turned = format!("<svg><path transform='rotate(1)' d='M{x} 0L{} 0 {} 1'/></svg>", x + 1.0, x + 1.0);
    assert!(error(&turned).contains("Move them near the origin"));
}

#[test]
fn style_sheets_of_drawing_programs_show_and_hide_and_move() {
    let line: &[[f64; 2]] = &[[5.0, 5.0], [6.0, 5.0]];
    // As written by Illustrator: classes with many rules about paint, an entity, and data for itself.
    let illustrator = "<?xml version='1.0'?><!DOCTYPE svg [<!ENTITY ns_ai 'http://ns.adobe.com/AdobeIllustrator/10.0/'>]>\
        <svg xmlns='http://www.w3.org/2000/svg' xmlns:i='&ns_ai;' viewBox='0 0 9 9'><style type='text/css'><![CDATA[\
        .st0{fill:#F00;stroke:#000;stroke-width:2;} .st1,.st2{display:none;} .st3{display:inline}]]></style>\
        <switch><foreignObject requiredExtensions='&ns_ai;' width='1' height='1'/><g i:extraneous='self'>\
        <path class='st0' d='M5 5h1'/><path class='st0 st1' d='M0 0h9'/><g class='st2'><path class='st3' d='M0 0h9'/></g>\
        </g></switch></svg>";
    expect(illustrator, &[("", line)]);
    let inkscape = "<svg xmlns='http://www.w3.org/2000/svg' xmlns:sodipodi='http://sodipodi' viewBox='0 0 9 9'>\
        <sodipodi:namedview><path d='M0 0h9'/></sodipodi:namedview><style id='s'>#layer1{transform:translate(5px,5px)} #gone{fill:red}</style>\
        <g id='layer1' style='display:inline'><path style='fill:none;stroke:#000' d='M0 0h1'/></g></svg>";
    let figma = "<svg viewBox='0 0 9 9' fill='none'><g clip-path='url(#c)' filter='url(#f)' mask='url(#m)'><path d='M5 5h1' stroke='url(#p)' \
        stroke-miterlimit='0'/></g><defs><clipPath id='c'><rect width='1' height='1'/></clipPath><filter id='f'/></defs></svg>";
    expect(figma, &[("", line)]);
    let transform = inkscape.replace("translate(5px,5px)", "translate(5 5)");
    expect(&transform, &[("layer1", line)]);
    expect(
        "<svg viewBox='0 0 9 9'><style>#a{font:2px x}</style><g id='a'><line x1='2.5em' y1='2.5em' x2='3em' y2='2.5em'/></g></svg>",
        &[("a", line)],
    );
    expect(
        "<svg viewBox='0 0 9 9'><style>path{display:none !important}</style><line x1='5' y1='5' x2='6' y2='5'/><path style='display:inline' d='M0 0h9'/></svg>",
        &[("", line)],
    );
}

#[test]
fn selectors_that_try_every_chain_of_ancestors_take_no_time() {
    // 593 bytes. Every test of time here counts comparisons: see `style`.
    let groups = |depth: usize, css: &str| {
        format!("<svg><style>{css}</style>{}<path d='M0 0h1'/>{}</svg>", "<g>".repeat(depth), "</g>".repeat(depth))
    };
    for (depth, css) in [(60, "x g g g g g g g g path{display:none}"), (120, "g g g g g x path{display:none}")] {
        assert_eq!(decoded(&groups(depth, css)).strokes.len(), 1);
    }
    assert!(matches!(
        decode_drawing(groups(60, "g g g g g g g g path{display:none}").as_bytes()),
        Err(AssetProblem::NoStrokes { .. })
    ));
    let comments = format!("a{}b{{display:none}}", "/**/".repeat(100_000));
    assert_eq!(decoded(&groups(1, &comments)).strokes.len(), 1);
}

#[test]
fn what_entities_hold_is_read_each_time() {
    let text = "<!DOCTYPE svg [<!ENTITY p \"<path d='M1000000 1000000l1 0l0 1'/>\">]><svg>&p;<g>&p;</g></svg>";
    let drawing = decoded(text);
    assert_eq!(drawing.strokes.len(), 2);
    assert!(
        drawing.strokes.iter().all(|stroke| stroke.points[1] == DVec2::new(1_000_001.0, 1_000_000.0)),
        "{drawing:?}"
    );
}

#[test]
fn uses_are_bounded_by_what_they_show_by_whatever_name() {
    let doubled: String = (1..40)
        .map(|n| format!("<g id='g{n}'><use x:href='#z' href=' #g{0}'/><use href='#g{0} '/></g>", n - 1))
        .collect();
    let text = format!(
        "<svg xmlns:x='http://www.w3.org/1999/xlink'><defs><path id='g0' d='M0 0H1'/>{doubled}</defs><use href='#g39'/></svg>"
    );
    assert!(error(&text).contains("points"), "{}", error(&text));
    let chain: String = (1..600).map(|n| format!("<g id='g{n}'><use href='#g{}'/></g>", n - 1)).collect();
    assert!(
        error(&format!("<svg><defs><path id='g0' d='M0 0H1'/>{chain}</defs><use href='#g599'/></svg>"))
            .contains("deep")
    );
    let long = format!("<path id='a' transform='{}' d='M0 0H1'/>", "rotate(1)".repeat(100_000));
    assert!(error(&format!("<svg><defs>{long}</defs>{}</svg>", "<use href='#a'/>".repeat(1000))).contains("bytes"));
    assert!(error(&format!("<svg>{}</svg>", "<use>".repeat(100_000) + &"</use>".repeat(100_000))).contains("deep"));
}

#[test]
fn a_symbol_stands_where_its_use_puts_it() {
    let text = "<svg viewBox='0 0 99 99'><symbol id='s' viewBox='0 0 10 10'><path d='M0 0h10'/></symbol>\
        <use href='#s' x='5' y='5' width='20' height='20' transform='translate(3 4)'/></svg>";
    expect(text, &[("", &[[8.0, 9.0], [28.0, 9.0]])]);
}
