//! The tables of a scene that all phenomena share, such as sky, ground, lights and obstacles, whatever their kinds.

use std::sync::Arc;

use bansho_base::{
    parameters::{ProblemKind, Reader, Table, Value},
    phenomenon::{strip::Shutter, surroundings::Light},
    tables::{LevelGround, SceneSky, SharedRole, SharedTable, TableKind},
};

use crate::{check, text::path::is_stated};

/// The shared tables of a scene. Those of a list are in the order of the text.
#[derive(Clone, Default)]
pub struct SharedTables {
    tables: Vec<SharedInstance>,
}

/// One shared table of a scene.
#[derive(Clone)]
pub struct SharedInstance {
    /// Its kind.
    pub kind: TableKind,
    /// Its parameters.
    pub parameters: Arc<dyn SharedTable>,
}

impl SharedInstance {
    fn new(parameters: impl SharedTable) -> Self {
        Self { kind: parameters.kind(), parameters: Arc::new(parameters) }
    }

    /// Changes the parameters. Returns what `change` returns.
    fn change<T>(&mut self, change: impl FnOnce(&mut dyn SharedTable) -> T) -> T {
        let mut parameters = self.parameters.clone_table();
        let result = change(parameters.as_mut());
        self.parameters = Arc::from(parameters);
        result
    }
}

impl SharedTables {
    /// Reads the shared tables of the scene `root`.
    pub(crate) fn read(root: &Table, kinds: &[TableKind], reader: &mut Reader) -> Self {
        let mut tables = Vec::new();
        for kind in kinds {
            let Some(SharedRole { read, .. }) = kind.shared_role() else { continue };
            if kind.is_list() {
                for (index, table) in items(root, kind.key, reader).into_iter().enumerate() {
                    let parameters = reader.within(kind.path(index), |reader| read(table, reader));
                    tables.push(SharedInstance { kind: *kind, parameters });
                }
            } else if let Some(table) = single(root, kind.key, reader) {
                let parameters = reader.within(kind.key, |reader| read(table, reader));
                tables.push(SharedInstance { kind: *kind, parameters });
            }
        }
        Self { tables }
    }

    /// All tables.
    pub fn iter(&self) -> impl Iterator<Item = &SharedInstance> {
        self.tables.iter()
    }

    /// All tables, each with its path in the scene: `sky`, `light.0`.
    pub fn with_paths(&self) -> impl Iterator<Item = (String, &SharedInstance)> {
        self.tables.iter().enumerate().map(|(position, table)| {
            let before = self.tables[..position].iter().filter(|other| other.kind.key == table.kind.key);
            (table.kind.path(before.count()), table)
        })
    }

    /// The first table with parameters of type `P`, such as the sky; `None` if there is none.
    pub fn get<P: SharedTable>(&self) -> Option<&P> {
        self.all().next()
    }

    /// The tables with parameters of type `P`, such as the lights.
    pub fn all<P: SharedTable>(&self) -> impl Iterator<Item = &P> {
        self.tables.iter().filter_map(|table| table.parameters.as_any().downcast_ref())
    }

    /// Puts `tables` in the place of all tables with parameters of type `P`.
    pub fn set_all<P: SharedTable>(&mut self, tables: impl IntoIterator<Item = P>) {
        self.tables.retain(|table| !table.parameters.as_any().is::<P>());
        self.tables.extend(tables.into_iter().map(SharedInstance::new));
    }

    /// Adds a table to a list, or puts it in the place of the one of its kind.
    pub fn put<P: SharedTable>(&mut self, parameters: P) {
        if parameters.kind().is_list() {
            self.tables.push(SharedInstance::new(parameters));
        } else {
            self.set_all([parameters]);
        }
    }

    /// Changes the parameters of all tables of type `P`.
    pub fn change_all<P: SharedTable + Clone>(&mut self, mut change: impl FnMut(&mut P)) {
        for table in &mut self.tables {
            if let Some(mut parameters) = table.parameters.as_any().downcast_ref::<P>().cloned() {
                change(&mut parameters);
                table.parameters = Arc::new(parameters);
            }
        }
    }

    /// The light of the sky at time `t`; `None` without a sky.
    pub fn sky(&self, t: f64) -> Option<SceneSky> {
        self.tables.iter().find_map(|table| table.parameters.sky(t))
    }

    /// The level ground at time `t`; `None` without one.
    pub fn level_ground(&self, t: f64) -> Option<LevelGround> {
        self.tables.iter().find_map(|table| table.parameters.level_ground(t))
    }

    /// The lights at time `t`.
    pub fn lights(&self, t: f64) -> impl Iterator<Item = Light> {
        self.tables.iter().filter_map(move |table| table.parameters.light(t))
    }

    /// Number of equal parts of an exposure, a power of two, in each of which no light moves or changes much.
    pub fn light_parts(&self, shutter: Shutter) -> usize {
        self.tables.iter().map(|table| table.parameters.light_parts(shutter)).max().unwrap_or(1)
    }

    /// Extinction coefficient at time `t` of the media that are everywhere, 1/m.
    pub fn extinction(&self, t: f64) -> f64 {
        self.tables.iter().map(|table| table.parameters.extinction(t)).sum()
    }

    /// Hides the tables with the keys `implied`: see [`SharedTable::hide`].
    pub(crate) fn hide(&mut self, implied: &[&str]) {
        self.tables
            .retain_mut(|table| !implied.contains(&table.kind.key) || table.change(|parameters| parameters.hide()));
    }

    /// Makes keyframed values repeat. Returns the path of the first whose values at the beginning and at the end differ.
    pub(crate) fn repeat_after(&mut self, seconds: f64) -> Option<String> {
        let paths: Vec<String> = self.with_paths().map(|(path, _)| path).collect();
        self.tables.iter_mut().zip(paths).find_map(|(table, path)| {
            let jump = table.change(|parameters| parameters.repeat_after(seconds))?;
            Some(bansho_base::parameters::path(&path, &jump))
        })
    }

    /// Reports values that are out of range.
    pub(crate) fn report_values(&self, reader: &mut Reader) {
        for (path, table) in self.with_paths() {
            reader.within(path, |reader| table.parameters.report_values(reader));
        }
    }

    /// Reports values that contradict each other, at their places in the scene `root`.
    pub(crate) fn report_conflicts(&self, root: &Table, reader: &mut Reader) {
        for (path, table) in self.with_paths() {
            for error in table.parameters.conflicts(&|key| is_stated(root, &format!("{path}.{key}"))) {
                check::report_build_error(error, path.clone(), root, reader);
            }
        }
    }
}

/// The table `[key]` of the scene `root`; reports it if it is no table.
pub(crate) fn single<'a>(root: &'a Table, key: &'static str, reader: &mut Reader) -> Option<&'a Table> {
    let node = root.get(key)?;
    match &node.value {
        Value::Table(table) => Some(table),
        value => {
            let expected = format!("a table [{key}]");
            let kind = ProblemKind::WrongType { expected, found: value.type_name() };
            reader.within(key, |reader| reader.report(node, kind));
            None
        }
    }
}

/// The tables of the list `[[key]]` of the scene `root`; reports what is no table.
pub(crate) fn items<'a>(root: &'a Table, key: &'static str, reader: &mut Reader) -> Vec<&'a Table> {
    let Some(node) = root.get(key) else { return Vec::new() };
    let mut tables = Vec::new();
    let items = match &node.value {
        Value::List(items) => items.as_slice(),
        _ => std::slice::from_ref(node),
    };
    for item in items {
        match &item.value {
            Value::Table(table) if matches!(node.value, Value::List(_)) => tables.push(table),
            value => {
                let kind = ProblemKind::WrongType {
                    expected: format!("tables [[{key}]], with double brackets"),
                    found: value.type_name(),
                };
                reader.within(key, |reader| reader.report(item, kind));
            }
        }
    }
    tables
}
