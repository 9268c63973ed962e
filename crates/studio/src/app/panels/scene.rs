//! What the scene holds: phenomena to hide, show alone, copy and remove, and everything they share.

use bansho::{
    KINDS,
    base::parameters::{Table, TableDescriptor, Value},
    render::scene::{Place, SHARED_TABLES, operation::Operation},
};

use crate::{
    document::{Document, Listed, phenomena::operations},
    session::Session,
};

use eframe::egui::{self, Ui};

/// What the inspector shows: a table of the scene.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Subject {
    /// The table's name in scene files.
    pub(crate) key: &'static str,
    /// Which of that name, where there may be many.
    pub(crate) index: Option<usize>,
}

impl Default for Subject {
    fn default() -> Self {
        Self { key: SHARED_TABLES[0].key, index: None }
    }
}

impl Subject {
    /// What a hand would reach for first: the first phenomenon, if there is one.
    pub(crate) fn first_of(document: &Document) -> Self {
        let first = document.phenomena().into_iter().next();
        first.map_or_else(Self::default, |listed| Self { key: listed.kind, index: Some(listed.index) })
    }

    /// Which of `kind` it is, or the first where it is something else.
    pub(crate) fn index_of(&self, kind: &str) -> usize {
        self.index.filter(|_| self.key == kind).unwrap_or_default()
    }

    /// Where it stands.
    pub(crate) fn place(&self) -> Place {
        let place = Place::root().key(self.key);
        self.index.map_or(place.clone(), |index| place.index(index))
    }

    /// What a person calls it.
    pub(super) fn title(&self, document: &Document) -> String {
        let listed =
            document.phenomena().into_iter().find(|listed| Some(listed.index) == self.index && listed.kind == self.key);
        match (listed, self.index) {
            (Some(listed), _) => listed.name,
            (None, Some(index)) => format!("{} {}", self.key, index + 1),
            (None, None) => self.key.to_owned(),
        }
    }

    /// Its parameters.
    pub(crate) fn descriptor(&self) -> Option<&'static TableDescriptor> {
        let shared = SHARED_TABLES.iter().find(|table| table.key == self.key).map(|table| (table.table)());
        shared.or_else(|| KINDS.iter().find(|kind| kind.key == self.key).map(|kind| (kind.table)()))
    }
}

/// Shows the panel; `subject` is what is chosen.
pub(crate) fn show(ui: &mut Ui, session: &mut Session, subject: &mut Subject) {
    ui.horizontal(|ui| {
        ui.heading("Scene");
        add_menu(ui, session, subject);
    });
    for listed in session.document.phenomena() {
        ui.push_id((listed.kind, listed.index), |ui| phenomenon(ui, session, subject, &listed));
    }
    ui.separator();
    for shared in SHARED_TABLES.iter().filter(|table| !table.many) {
        row(ui, subject, Subject { key: shared.key, index: None }, shared.key);
    }
    for shared in SHARED_TABLES.iter().filter(|table| table.many) {
        let count = match session.document.values().get(shared.key).map(|node| &node.value) {
            Some(Value::List(items)) => items.len(),
            _ => 0,
        };
        for index in 0..count {
            let own = Subject { key: shared.key, index: Some(index) };
            let response = row(ui, subject, own.clone(), &format!("{} {}", shared.key, index + 1));
            response.context_menu(|ui| {
                if ui.button("Remove").clicked() {
                    session.edit("remove", &[Operation::Remove { place: own.place() }]);
                    *subject = Subject::default();
                }
            });
        }
    }
}

fn row(ui: &mut Ui, subject: &mut Subject, own: Subject, text: &str) -> egui::Response {
    let response = ui.selectable_label(*subject == own, text);
    if response.clicked() {
        *subject = own;
    }
    response
}

fn add_menu(ui: &mut Ui, session: &mut Session, subject: &mut Subject) {
    ui.menu_button("Add", |ui| {
        for kind in KINDS {
            if ui.button(kind.key).on_hover_text((kind.table)().doc.as_str()).clicked() {
                let index = session.document.phenomena().iter().filter(|listed| listed.kind == kind.key).count();
                let add = operations::add(&session.document, kind.key);
                session.edit("add", &add);
                *subject = Subject { key: kind.key, index: Some(index) };
                ui.close();
            }
        }
        ui.separator();
        for shared in SHARED_TABLES.iter().filter(|table| table.many) {
            if ui.button(shared.key).on_hover_text((shared.table)().doc.as_str()).clicked() {
                let place = Place::root().key(shared.key);
                session.edit("add", &[Operation::Append { place, value: Value::Table(Table::default()) }]);
                ui.close();
            }
        }
    })
    .response
    .on_hover_text("Add a phenomenon, a light or an obstacle");
}

fn phenomenon(ui: &mut Ui, session: &mut Session, subject: &mut Subject, listed: &Listed) {
    let own = Subject { key: listed.kind, index: Some(listed.index) };
    ui.horizontal(|ui| {
        let mut enabled = listed.enabled;
        let name = format!("Draw {}", listed.name);
        let shown = ui.checkbox(&mut enabled, "").on_hover_text(&name).accessible_name(name);
        if shown.changed() {
            session.edit("hide", &[operations::set_enabled(listed, enabled)]);
        }
        let response = row(ui, subject, own, &listed.name).on_hover_text(listed.kind);
        response.context_menu(|ui| context_menu(ui, session, subject, listed));
        let solo = ui.small_button("S").on_hover_text(format!("Draw only {}, or all again", listed.name));
        let solo = solo.accessible_name(format!("Solo {}", listed.name));
        if solo.clicked() {
            let change = operations::solo(&session.document, listed);
            session.edit("solo", &change);
        }
    });
}

fn context_menu(ui: &mut Ui, session: &mut Session, subject: &mut Subject, listed: &Listed) {
    rename(ui, session, listed);
    if ui.button("Duplicate").clicked() {
        let copy = operations::duplicate(&session.document, listed);
        session.edit("duplicate", &copy);
        ui.close();
    }
    if ui.button("Remove").clicked() {
        session.edit("remove", &[Operation::Remove { place: listed.place() }]);
        *subject = Subject::default();
        ui.close();
    }
}

/// A field for its name. Half a name may be another's, so that only a whole one is taken.
fn rename(ui: &mut Ui, session: &mut Session, listed: &Listed) {
    let kept = ui.scope_id().with("name");
    let mut name = ui.data(|data| data.get_temp::<String>(kept)).unwrap_or_else(|| listed.name.clone());
    ui.horizontal(|ui| {
        let label = ui.label("Name").id;
        let field = ui.add(egui::TextEdit::singleline(&mut name).desired_width(120.0)).labelled_by(label);
        if field.changed() {
            ui.data_mut(|data| data.insert_temp(kept, name.clone()));
        }
        if field.lost_focus() {
            ui.data_mut(|data| data.remove::<String>(kept));
            if !name.trim().is_empty() && name != listed.name {
                let place = listed.place().key("name");
                session.edit("rename", &[Operation::Set { place, value: Value::Text(name.trim().to_owned()) }]);
                ui.close();
            }
        }
    });
}
