//! Modules beside each other do not use each other in a circle: in every crate, for every module, its children are in an order in which each
//! uses only those before it. Parent and child may use each other. What is used counts as of the module that defines it, not of those that re-export it.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use syn::{
    Attribute, Item, ItemMod, UseTree,
    visit::{self, Visit},
};

/// The path of a module within its crate, empty for the crate itself.
type Module = Vec<String>;

/// Which modules each module names, in a crate.
type Uses = BTreeMap<Module, BTreeSet<Module>>;

/// The modules of a crate with the source of each, without those that are compiled for tests only.
struct Crate {
    modules: BTreeMap<Module, syn::File>,
    /// For each module, the names that its `use` items bring into it, with the paths that they stand for.
    imports: BTreeMap<Module, BTreeMap<String, Vec<String>>>,
}

impl Crate {
    fn read(source: &Path) -> Self {
        let mut modules = BTreeMap::new();
        for root in ["lib.rs", "main.rs"].map(|name| source.join(name)).iter().filter(|root| root.exists()) {
            Self::read_module(root, source, &Module::new(), &mut modules);
        }
        Self::new(modules)
    }

    fn new(modules: BTreeMap<Module, syn::File>) -> Self {
        let imports = modules.iter().map(|(module, file)| (module.clone(), imports_of(file))).collect();
        Self { modules, imports }
    }

    /// Reads the file of a module, then its children from `folder`.
    fn read_module(file: &Path, folder: &Path, module: &Module, modules: &mut BTreeMap<Module, syn::File>) {
        let text = fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let parsed = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        for item in &parsed.items {
            let Item::Mod(ItemMod { attrs, ident, content: None, .. }) = item else { continue };
            if is_for_tests(attrs) {
                continue;
            }
            let name = ident.to_string();
            let (alone, inside) = (folder.join(format!("{name}.rs")), folder.join(&name).join("mod.rs"));
            let child = [&module[..], std::slice::from_ref(&name)].concat();
            Self::read_module(if alone.exists() { &alone } else { &inside }, &folder.join(&name), &child, modules);
        }
        modules.insert(module.clone(), parsed);
    }

    fn uses(&self) -> Uses {
        let mut uses = Uses::new();
        for (module, file) in &self.modules {
            let mut paths = Paths { code: self, module, named: BTreeSet::new() };
            paths.visit_file(file);
            uses.insert(module.clone(), paths.named);
        }
        uses
    }

    /// The deepest module that `path` leads to from `module`, where it begins with `crate`, `self`, `super` or a child of the module: the one that defines
    /// what it names. Names that a module imports are followed to where they come from, through at most `imports_left` imports.
    fn definition(&self, module: &Module, path: &[String], imports_left: usize) -> Option<Module> {
        let first = path.first()?;
        let mut target = match first.as_str() {
            "crate" => Module::new(),
            "self" | "super" => module.clone(),
            _ if self.modules.contains_key(&[&module[..], &path[..1]].concat()) => module.clone(),
            _ => return None,
        };
        for (index, name) in path.iter().enumerate() {
            match name.as_str() {
                "crate" | "self" => {}
                "super" => {
                    target.pop();
                }
                _ => {
                    let next = [&target[..], std::slice::from_ref(name)].concat();
                    if self.modules.contains_key(&next) {
                        target = next;
                        continue;
                    }
                    let import = self.imports.get(&target).and_then(|imports| imports.get(name));
                    let Some(import) = import.filter(|_| imports_left > 0) else { break };
                    let path = [&import[..], &path[index + 1..]].concat();
                    // What another crate defines is of none of these modules.
                    return Some(self.definition(&target, &path, imports_left - 1).unwrap_or(target));
                }
            }
        }
        Some(target)
    }
}

/// The names that the `use` items of a file bring into its module, with the paths that they stand for.
fn imports_of(file: &syn::File) -> BTreeMap<String, Vec<String>> {
    let mut imports = BTreeMap::new();
    for item in &file.items {
        if let Item::Use(item) = item
            && !is_for_tests(&item.attrs)
        {
            collect_imports(&[], &item.tree, &mut imports);
        }
    }
    imports
}

fn collect_imports(before: &[String], tree: &UseTree, imports: &mut BTreeMap<String, Vec<String>>) {
    match tree {
        UseTree::Path(path) => {
            collect_imports(&[before, &[path.ident.to_string()]].concat(), &path.tree, imports);
        }
        UseTree::Name(name) if name.ident == "self" => {
            imports.extend(before.last().map(|last| (last.clone(), before.to_vec())));
        }
        UseTree::Name(name) => {
            imports.insert(name.ident.to_string(), [before, &[name.ident.to_string()]].concat());
        }
        UseTree::Rename(rename) => {
            imports.insert(rename.rename.to_string(), [before, &[rename.ident.to_string()]].concat());
        }
        UseTree::Glob(_) => {}
        UseTree::Group(group) => group.items.iter().for_each(|tree| collect_imports(before, tree, imports)),
    }
}

fn is_for_tests(attributes: &[Attribute]) -> bool {
    let is_test = |attribute: &Attribute| {
        let list = attribute.meta.require_list().ok().filter(|list| list.path.is_ident("cfg"));
        list.is_some_and(|list| list.tokens.to_string() == "test")
    };
    attributes.iter().any(is_test)
}

/// Longest chain of re-exports that is followed.
const MAX_IMPORTS: usize = 8;

/// Collects the modules of the own crate that the paths of one module lead to.
struct Paths<'a> {
    code: &'a Crate,
    module: &'a Module,
    named: BTreeSet<Module>,
}

impl Paths<'_> {
    /// Notes the module that defines what `path` names.
    fn note(&mut self, path: &[String]) {
        self.named.extend(self.code.definition(self.module, path, MAX_IMPORTS));
    }

    fn note_use(&mut self, before: &[String], tree: &UseTree) {
        let with = |name: &syn::Ident| [before, &[name.to_string()]].concat();
        match tree {
            UseTree::Path(path) => self.note_use(&with(&path.ident), &path.tree),
            UseTree::Name(name) => self.note(&with(&name.ident)),
            UseTree::Rename(rename) => self.note(&with(&rename.ident)),
            UseTree::Glob(_) => self.note(before),
            UseTree::Group(group) => group.items.iter().for_each(|tree| self.note_use(before, tree)),
        }
    }
}

impl<'ast> Visit<'ast> for Paths<'_> {
    fn visit_item(&mut self, item: &'ast Item) {
        let attributes = match item {
            Item::Mod(item) => &item.attrs,
            Item::Use(item) => &item.attrs,
            Item::Fn(item) => &item.attrs,
            Item::Impl(item) => &item.attrs,
            _ => return visit::visit_item(self, item),
        };
        if !is_for_tests(attributes) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        self.note_use(&[], &item.tree);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        if path.segments.len() > 1 {
            self.note(&path.segments.iter().map(|segment| segment.ident.to_string()).collect::<Vec<String>>());
        }
        visit::visit_path(self, path);
    }

    fn visit_item_mod(&mut self, item: &'ast ItemMod) {
        // A module within the file: its paths would be resolved from another module.
        if item.content.is_some() {
            return;
        }
        visit::visit_item_mod(self, item);
    }
}

/// For every module, which of its children use which others, by name.
fn siblings(uses: &Uses) -> BTreeMap<Module, BTreeMap<String, BTreeSet<String>>> {
    let mut siblings: BTreeMap<Module, BTreeMap<String, BTreeSet<String>>> = BTreeMap::new();
    for (from, targets) in uses {
        for to in targets {
            let common = from.iter().zip(to).take_while(|(a, b)| a == b).count();
            if common < from.len() && common < to.len() {
                let children = siblings.entry(from[..common].to_vec()).or_default();
                children.entry(from[common].clone()).or_default().insert(to[common].clone());
            }
        }
    }
    siblings
}

/// The modules of a circle, if there is one: what remains after modules that use nothing that remains are taken away again and again, and
/// those that nothing uses as well.
fn cycle(uses: &BTreeMap<String, BTreeSet<String>>) -> BTreeSet<String> {
    let mut left: BTreeSet<String> = uses.keys().cloned().collect();
    loop {
        let leads_on = |name: &String| uses[name].iter().any(|used| left.contains(used));
        let is_used = |name: &String| left.iter().any(|other| uses[other].contains(name));
        let kept: BTreeSet<String> = left.iter().filter(|name| leads_on(name) && is_used(name)).cloned().collect();
        if kept.len() == left.len() {
            return left;
        }
        left = kept;
    }
}

fn cycles(name: &str, uses: &Uses) -> Vec<String> {
    let circle = |(parent, children): (Module, BTreeMap<String, BTreeSet<String>>)| {
        let found = cycle(&children);
        let lines = found.iter().map(|child| {
            let used: Vec<&str> = children[child].intersection(&found).map(String::as_str).collect();
            format!("    {child} uses {}", used.join(", "))
        });
        let lines: Vec<String> = lines.collect();
        let parent = [&[name.to_owned()], &parent[..]].concat().join("::");
        (!lines.is_empty()).then(|| format!("{parent}\n{}", lines.join("\n")))
    };
    siblings(uses).into_iter().filter_map(circle).collect()
}

#[test]
fn no_modules_use_each_other_in_a_circle() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let (mut found, mut modules) = (Vec::new(), 0);
    for entry in fs::read_dir(crates).unwrap() {
        let folder = entry.unwrap().path();
        let source = folder.join("src");
        if source.exists() {
            let code = Crate::read(&source);
            modules += code.modules.len();
            found.extend(cycles(&folder.file_name().unwrap().to_string_lossy(), &code.uses()));
        }
    }
    assert!(modules > 300, "only {modules} modules were read");
    assert!(found.is_empty(), "modules that use each other in a circle:\n{}", found.join("\n"));
}

#[test]
fn a_circle_is_found() {
    let file = |text: &str| syn::parse_file(text).unwrap();
    let module = |path: &str| path.split("::").filter(|name| !name.is_empty()).map(str::to_owned).collect::<Module>();
    let modules = [
        ("", "mod draw; mod physics; pub const SIZE: usize = 3;"),
        ("draw", "use crate::{SIZE, physics::air::Air}; mod tests_only {}"),
        ("physics", "pub mod air;"),
        ("physics::air", "fn shown() -> u8 { super::super::draw::code(crate::SIZE) }"),
    ];
    let parsed =
        |modules: &[(&str, &str)]| Crate::new(modules.iter().map(|(path, text)| (module(path), file(text))).collect());
    let expected = ["any\n    draw uses physics\n    physics uses draw".to_owned()];
    assert_eq!(cycles("any", &parsed(&modules).uses()), expected);
    let mut broken = modules;
    broken[3].1 = "#[cfg(test)] mod tests { use crate::draw::code; } #[cfg(test)] fn shown() { crate::draw::code(0); }";
    assert_eq!(cycles("any", &parsed(&broken).uses()), Vec::<String>::new());
}

#[test]
fn a_circle_through_re_exports_is_found() {
    let modules = [
        ("", "mod draw; mod model; pub use model::{Flame, shape as form};"),
        ("model", "pub use self::state::Flame; use crate::draw::code; pub(crate) mod shape; mod state;"),
        ("model::state", "pub struct Flame;"),
        ("model::shape", ""),
        ("draw", "use crate::Flame; pub fn code() {}"),
    ];
    let module = |path: &str| path.split("::").filter(|name| !name.is_empty()).map(str::to_owned).collect::<Module>();
    let parsed = |modules: &[(&str, &str)]| {
        Crate::new(modules.iter().map(|(path, text)| (module(path), syn::parse_file(text).unwrap())).collect())
    };
    let code = parsed(&modules);
    let path = |text: &str| text.split("::").map(str::to_owned).collect::<Vec<String>>();
    let definition = |text: &str| code.definition(&module("draw"), &path(text), MAX_IMPORTS);
    assert_eq!(definition("crate::Flame"), Some(module("model::state")));
    assert_eq!(definition("crate::form::area"), Some(module("model::shape")));
    assert_eq!(definition("super::Absent"), Some(module("")));
    assert_eq!(cycles("any", &code.uses()), ["any\n    draw uses model\n    model uses draw"]);
    let mut broken = modules;
    broken[4].1 = "#[cfg(test)] use crate::Flame; pub fn code() {}";
    assert_eq!(cycles("any", &parsed(&broken).uses()), Vec::<String>::new());
}
