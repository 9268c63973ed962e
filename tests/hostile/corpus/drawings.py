"""Drawings: SVG files that are broken, huge or clever."""

import gzip
import zlib

from .case import Case, Content, lines, parts

SCENE = 'bansho = 2\n[picture]\nsize = [32, 24]\nframes = 2\n[[aurora]]\n[[aurora.shapes]]\n[[aurora.shapes.sheets]]\nsvg_file = "drawing.svg"\n'
MEGA = 1_000_000
LINE = '<path d="M1 5L9 5"/>'


def _drawing(name: str, content: Content, code: int | tuple[int, ...] = 3, words: str = "", **more) -> Case:
    # What only shows once the strokes are laid out is told at the sheet, or at the list of them.
    says = rf"^error: scene\.toml:(8:12: aurora\.0\.shapes\.0\.sheets\.0\.svg_file .*drawing\.svg.*({words})|7:\d+: aurora\.0\.shapes\.0\.sheets.*allowed|7:\d+: aurora\.0\.shapes\.0\.sheets.*crosses itself)"
    return Case("svg", name, ["check", "scene.toml"], code, says, {"scene.toml": SCENE, "drawing.svg": content}, **more)


def _svg(inner: str) -> str:
    return f'<svg viewBox="0 0 10 10">{inner}</svg>'


def _path(name: str, path: str, code: int | tuple[int, ...] = 3, words: str = "", **more) -> Case:
    return _drawing(name, _svg(f'<path id="a" d="{path}"/>'), code, words, **more)


def _laughs() -> str:
    """A billion laughs: ten entities, each ten of the one before."""
    entities = '<!ENTITY l0 "M1 5L9 5">' + "".join(f'<!ENTITY l{level} "{f"&l{level - 1};" * 10}">' for level in range(1, 10))
    return f'<?xml version="1.0"?><!DOCTYPE svg [{entities}]>' + _svg('<path d="&l9;"/>')


def _packed_spaces() -> bytes:
    """A gigabyte in a megabyte."""
    packer = zlib.compressobj(9, zlib.DEFLATED, 31)
    return b"".join([*(packer.compress(b" " * MEGA) for _ in range(1000)), packer.flush()])


def _doubling_uses() -> str:
    groups = "".join(f'<g id="g{level}"><use href="#g{level - 1}"/><use href="#g{level - 1}"/></g>' for level in range(1, 41))
    return _svg(f'<defs><path id="g0" d="M1 5L9 5"/>{groups}</defs><use href="#g40"/>')


def _nested(depth: int, css: str) -> str:
    return f"<svg><style>{css}</style>{'<g>' * depth}{LINE}{'</g>' * depth}</svg>"


def _style_sheets() -> list[Case]:
    """Selectors that a matcher might try again and again, and sheets that are much more than their drawing."""
    chains = [(8, 60), (5, 120), (200, 250)]
    rules = lines(30_000, lambda index: f".c{index} .d{index}{{display:none}}", "<svg><style>", f"</style>{'<g/>' * 3000}{LINE}</svg>")
    cases = [_drawing(f"a selector of {length} names within {depth} groups", _nested(depth, f"x {'g ' * length}path{{display:none}}"), 0) for length, depth in chains]
    return [
        *cases,
        _drawing("30,000 rules", rules, 0, signaled=True, large=True),
        _drawing("30,000 rules for all of 30,000 elements", parts(("<svg><style>", 1), ("*{display:inline}", 30_000), ("</style>", 1), (LINE, 30_000), ("</svg>", 1)), 3, "comparisons", signaled=True, large=True),
        _drawing("a million selectors of one rule", parts(("<svg><style>", 1), ("a,", MEGA), (f"b{{display:none}}</style>{LINE}</svg>", 1)), 3, "parts of selectors", signaled=True, large=True),
        _drawing("10,000 selectors with 10,000 declarations", parts(("<svg><style>", 1), ("a,", 10_000), ("b{", 1), ("display:none;", 10_000), (f"}}</style>{LINE}</svg>", 1)), 0),
        _drawing("a million comments in a selector", parts(("<svg><style>a", 1), ("/**/", MEGA), (f"b{{display:none}}</style>{LINE}</svg>", 1)), 0, signaled=True, large=True),
        _drawing("a million open comments", parts(("<svg><style>", 1), ("/*", MEGA), (f"</style>{LINE}</svg>", 1)), 0),
        _drawing("a million open braces", parts(("<svg><style>", 1), ("{", MEGA), (f"</style>{LINE}</svg>", 1)), 0, signaled=True),
        _drawing("20,000 classes of 2,000 elements", parts(("<svg><style>", 1), (".a{display:inline}", 20_000), ("</style>", 1), ('<path class="a a b" d="M1 5L9 5"/>', 2000), ("</svg>", 1)), 3, "comparisons"),
        _drawing("a style sheet that is none", _svg("<style>" + "}}{{;;@@,,>>++" * 1000 + "</style>" + LINE), 0),
    ]


def _markup() -> list[Case]:
    """Entities, namespaces and nesting by which a parser would do far more than it reads."""
    entity = f"<!DOCTYPE svg [<!ENTITY a '{'x' * MEGA}'>]>"
    twice = "<!DOCTYPE svg [<!ENTITY p \"<path d='M1000000 1000000l1 0l0 1'/>\">]><svg>&p;&p;</svg>"
    prefixes = "".join(f' xmlns:a{index}="{index}"' for index in range(4000))
    return [
        _drawing("a megabyte a thousand times by an entity", parts((entity + "<svg><desc>", 1), ("&a;", 1000), (f"</desc>{LINE}</svg>", 1)), words="entities are replaced"),
        _drawing("30,000 entities", lines(30_000, lambda index: f"<!ENTITY a{index} 'x'>", "<!DOCTYPE svg [", f"]><svg>{LINE}</svg>"), words="entities; allowed"),
        _drawing("an element of an entity, twice", twice, (0, 3)),
        _drawing("4,000 namespaces copied by 200,000 elements", parts((f"<svg{prefixes}>", 1), ('<g xmlns:a="b"/>', 200_000), (LINE + "</svg>", 1)), words="namespace prefixes", large=True),
        _drawing("100,000 attributes behind a bracket", _svg("<path a='>' " + "".join(f"a{index}='1' " for index in range(100_000)) + "d='M1 5L9 5'/>"), words="attributes"),
        _drawing("200,000 uses within one another", parts(("<svg>", 1), ("<use>", 200_000), ("</use>", 200_000), ("</svg>", 1)), words="deep", large=True),
        _drawing("600 groups that use one another in a chain", _svg("<defs><path id='g0' d='M1 5L9 5'/>" + "".join(f"<g id='g{index}'><use href='#g{index - 1}'/></g>" for index in range(1, 600)) + "</defs><use href='#g599'/>"), words="deep"),
        _drawing("a doubling behind two targets", _doubling_uses().replace("<svg ", '<svg xmlns:x="http://www.w3.org/1999/xlink" ').replace('<use href="', '<use x:href="#none" href=" '), words="points"),
        _drawing("a transform of a megabyte, used a thousand times", _svg(f"<defs><path id='a' transform='{'rotate(1)' * 100_000}' d='M1 5L9 5'/></defs>" + "<use href='#a'/>" * 1000), words="bytes"),
        _drawing("20,000 nested drawings, each of which clips", _svg('<svg width="5" height="5"><path d="M1 1L9 5"/></svg>' * 20_000), (0, 3)),
    ]


def cases() -> list[Case]:
    head, tail = _svg("|").split("|")
    external = '<!DOCTYPE svg [<!ENTITY x SYSTEM "file:///etc/passwd">]>'
    return [
        _drawing("whole", _svg(LINE), 0),
        _drawing("empty", "", words="not an SVG"),
        _drawing("text", "no drawing", words="not an SVG"),
        _drawing("HTML", "<html><body/></html>", words="not an SVG"),
        _drawing("no strokes", _svg(""), words="no strokes"),
        _drawing("only what is no stroke", _svg('<rect/><use href="#a"/><text>a</text>'), words="only rect, use, text"),
        _drawing("no UTF-8", b"<svg>\xff\xfe</svg>", words="UTF-8"),
        _drawing("UTF-16", _svg(LINE).encode("utf-16"), 0),
        _drawing("UTF-16 that ends within a pair", b"\xff\xfe" + b"\0\xd8", words="UTF-16"),
        _drawing("packed", gzip.compress(_svg(LINE).encode()), 0),
        _drawing("packed and cut", gzip.compress(_svg(LINE).encode())[:20], words="damaged"),
        _drawing("packed: 1 GB of spaces", _packed_spaces(), words="unpacked", signaled=True),
        _drawing("5,000 uses of 1,000 points", _svg(f'<defs><path id="a" d="M0 0{"L1 1" * 1000}"/></defs>' + '<use href="#a"/>' * 5000), words="points"),
        _drawing("uses that double 40 times", _doubling_uses(), words="points"),
        _drawing("a use of itself", _svg('<g id="a"><use href="#a"/></g>'), words="use themselves"),
        _drawing("NUL", _svg(LINE).replace("svg", "s\0vg"), words=""),
        _drawing("a billion laughs", _laughs(), words="entities"),
        _drawing("an external entity", external + _svg('<path d="&x;"/>'), words="entity"),
        _drawing("an external entity beside a stroke", external + _svg("<text>&x;</text>" + LINE), words="entity"),
        _drawing("an external style sheet", '<?xml-stylesheet href="file:///dev/zero"?>' + _svg(f'<image href="/dev/zero"/>{LINE}'), 0),
        _drawing("an unclosed tag", "<svg><path d='M0 0L1 1'", words="never closed"),
        _drawing("an unclosed comment", "<svg><!-- ", words="expected"),
        _drawing("an unclosed declaration", "<!DOCTYPE svg [ <!ENTITY", words="not an SVG"),
        _drawing("an unclosed attribute", "<svg><path d='M0 0", words="unexpected end"),
        _drawing("an attribute without quotes", "<svg a=1/>", words="quote"),
        _drawing("tags that close what is not open", "</svg>" * 1000 + _svg(LINE), (0, 3)),
        _drawing("1,000,000 tags that close nothing", parts(("</svg>", MEGA), (_svg(LINE), 1)), (0, 3), signaled=True, large=True),
        _drawing("groups 100,000 deep", parts((head, 1), ("<g>", 100_000), (LINE, 1), ("</g>", 100_000), (tail, 1)), (0, 3), signaled=True),
        _drawing("transforms 100,000 deep", parts((head, 1), ('<g transform="rotate(1) scale(1)">', 100_000), (LINE, 1), ("</g>", 100_000), (tail, 1)), (0, 3), signaled=True),
        _drawing("transforms that grow without end", parts((head, 1), ('<g transform="scale(10)">', 1000), (LINE, 1), ("</g>", 1000), (tail, 1)), words="deep|infinitely far|transform"),
        _drawing("transforms that shrink to nothing", parts((head, 1), ('<g transform="scale(0.1)">', 1000), (LINE, 1), ("</g>", 1000), (tail, 1)), (0, 3)),
        _drawing("a transform of 100,000 parts", _svg(f'<path transform="{"rotate(1) " * 100_000}" d="M1 5L9 5"/>'), (0, 3)),
        _drawing("a transform of nothing known", _svg('<g transform="turn(3)"/>'), words="transform"),
        _drawing("a transform that does not end", _svg('<g transform="scale(3"/>'), words="transform"),
        _drawing("a view box of nothing", f'<svg viewBox="0 0 0 0">{LINE}</svg>', words="viewBox"),
        _drawing("a view box of huge numbers", f'<svg viewBox="-1e308 -1e308 1e308 1e308">{LINE}</svg>', (0, 3)),
        _drawing("a view box of denormal numbers", f'<svg viewBox="0 0 5e-324 5e-324">{LINE}</svg>', (0, 3)),
        _path("no path", "hello world", words="path"),
        _path("a path that begins with a line", "L9 5", words="path"),
        _path("a path that lacks numbers", "M1 5L9", words="path data"),
        _path("a path of huge numbers", "M1e308 1e308L-1e308 -1e308", (0, 3)),
        _path("a path of infinite numbers", "M1e999 0L1 1", words="path"),
        _path("a path of not-a-numbers", "MNaN NaN L1 1", words="path"),
        _path("a path of denormal numbers", "M5e-324 5e-324L-5e-324 0", (0, 3)),
        _path("a path of one place", "M5 5L5 5L5 5", (0, 3)),
        _path("relative lines that go ever farther", "M0 0" + "l1e307 0" * 50, (0, 3), "infinitely far"),
        _path("an arc without a radius", "M1 5A0 0 0 0 1 9 5", (0, 3)),
        _path("an arc of huge radius", "M1 5A1e308 1e308 0 1 1 9 5", (0, 3)),
        _path("flags that are none", "M1 5A1 1 0 7 7 9 5", words="path"),
        _path("a number of 100,000 digits", "M1 5L" + "9" * 100_000 + " 5", words="path"),
        _path("100,000 spaces", "M1 5L9" + " " * 100_000 + "5", 0),
        _path("100,000 closes", "M1 5L9 5" + "Z" * 100_000, (0, 3)),
        _drawing("1,000,000 segments", lines(MEGA // 2, lambda index: f"L{index % 97} {index % 89}", head + '<path d="M1 5', '"/>' + tail), (0, 3), "points", signaled=True, large=True),
        _drawing("3,000,000 segments", parts((head + '<path d="M1 5', 1), ("l1 0", 3 * MEGA), ('"/>' + tail, 1)), 3, "points", signaled=True, large=True),
        _drawing("1,000,000 curves", parts((head + '<path d="M1 5', 1), ("c1 1 2 2 3 0", MEGA), ('"/>' + tail, 1)), 3, "points", signaled=True, large=True),
        _drawing("100,000 strokes", parts((head, 1), (LINE, 100_000), (tail, 1)), (0, 3), signaled=True),
        _drawing("100,000 attributes", head + "<path " + "".join(f"a{index}='1' " for index in range(100_000)) + "d='M1 5L9 5'/>" + tail, (0, 3), signaled=True),
        _drawing("10,000 bracketed declarations", parts(("<!DOCTYPE svg [ ] >", 10_000), (_svg(LINE), 1)), (0, 3)),
        _drawing("1,000,000 declarations without brackets", parts(("<!a>", MEGA), (_svg(LINE), 1)), (0, 3), signaled=True, large=True),
        _drawing("15 MB of text", parts((head, 1), ("a" * 1000, 15_000), (LINE + tail, 1)), 0, signaled=True, large=True),
        _drawing("an id of a megabyte", _svg(f'<path id="{"a" * MEGA}" d="L"/>'), words="path"),
        *_style_sheets(),
        *_markup(),
        Case("svg", "an id that is not there", ["check", "scene.toml"], 3, r"^error: scene\.toml:9:15: aurora\.0\.shapes\.0\.sheets\.0\.svg_path_id .*no stroke with the id `gone`",
             {"scene.toml": SCENE + 'svg_path_id = "gone"\n', "drawing.svg": _svg(LINE)}),
    ]
