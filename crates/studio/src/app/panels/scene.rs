//! The scene panel: phenomena to hide, solo, duplicate and remove, and the shared tables.

use bansho::{
    KINDS,
    base::{
        parameters::{Table, Value},
        tables,
    },
    phenomena,
    scene::{ValuePath, operation::Operation},
};

use crate::{
    document::{PhenomenonEntry, phenomena::operations},
    session::{Session, selection::Selection},
};

use eframe::egui::{self, Ui};

/// Shows the panel and updates `selection`.
pub(crate) fn scene_ui(ui: &mut Ui, session: &mut Session, selection: &mut Selection) {
    ui.horizontal(|ui| {
        ui.heading("Scene");
        add_menu_ui(ui, session, selection);
    });
    for entry in session.document.phenomena() {
        ui.push_id((entry.id.kind, entry.id.index), |ui| phenomenon_ui(ui, session, selection, &entry));
    }
    ui.separator();
    for shared in tables::shared(KINDS).filter(|kind| !kind.is_list()) {
        row_ui(ui, selection, Selection { key: shared.key, index: None }, shared.key);
    }
    for shared in tables::shared(KINDS).filter(|kind| kind.is_list()) {
        let count = match session.document.values().get(shared.key).map(|node| &node.value) {
            Some(Value::List(items)) => items.len(),
            _ => 0,
        };
        for index in 0..count {
            let own = Selection { key: shared.key, index: Some(index) };
            let response = row_ui(ui, selection, own.clone(), &format!("{} {}", shared.key, index + 1));
            response.context_menu(|ui| {
                if ui.button("Remove").clicked() {
                    session.edit("remove", &[Operation::Remove { path: own.path() }]);
                    *selection = Selection::default();
                }
            });
        }
    }
}

fn row_ui(ui: &mut Ui, selection: &mut Selection, own: Selection, text: &str) -> egui::Response {
    let response = ui.selectable_label(*selection == own, text);
    if response.clicked() {
        *selection = own;
    }
    response
}

fn add_menu_ui(ui: &mut Ui, session: &mut Session, selection: &mut Selection) {
    ui.menu_button("Add", |ui| {
        for kind in phenomena() {
            if ui.button(kind.key).on_hover_text((kind.table)().doc.as_str()).clicked() {
                let index = session.document.phenomena().iter().filter(|entry| entry.id.kind == kind.key).count();
                let add = operations::add(&session.document, kind.key);
                session.edit("add", &add);
                *selection = Selection { key: kind.key, index: Some(index) };
                ui.close();
            }
        }
        ui.separator();
        for shared in tables::shared(KINDS).filter(|kind| kind.is_list()) {
            if ui.button(shared.key).on_hover_text((shared.table)().doc.as_str()).clicked() {
                let path = ValuePath::root().key(shared.key);
                session.edit("add", &[Operation::Append { path, value: Value::Table(Table::default()) }]);
                ui.close();
            }
        }
    })
    .response
    .on_hover_text("Add a phenomenon, a light or an obstacle");
}

fn phenomenon_ui(ui: &mut Ui, session: &mut Session, selection: &mut Selection, entry: &PhenomenonEntry) {
    let own = Selection::from(entry.id);
    ui.horizontal(|ui| {
        let mut enabled = entry.enabled;
        let name = format!("Draw {}", entry.name);
        let shown = ui.checkbox(&mut enabled, "").on_hover_text(&name).accessible_name(name);
        if shown.changed() {
            session.edit("hide", &[operations::set_enabled(entry, enabled)]);
        }
        let response = row_ui(ui, selection, own, &entry.name).on_hover_text(entry.id.kind);
        response.context_menu(|ui| phenomenon_menu_ui(ui, session, selection, entry));
        let solo = ui.small_button("S").on_hover_text(format!("Draw only {}, or all again", entry.name));
        let solo = solo.accessible_name(format!("Solo {}", entry.name));
        if solo.clicked() {
            let change = operations::solo(&session.document, entry);
            session.edit("solo", &change);
        }
    });
}

fn phenomenon_menu_ui(ui: &mut Ui, session: &mut Session, selection: &mut Selection, entry: &PhenomenonEntry) {
    rename_ui(ui, session, entry);
    if ui.button("Duplicate").clicked() {
        let copy = operations::duplicate(&session.document, entry);
        session.edit("duplicate", &copy);
        ui.close();
    }
    if ui.button("Remove").clicked() {
        session.edit("remove", &[Operation::Remove { path: entry.id.path() }]);
        *selection = Selection::default();
        ui.close();
    }
}

/// A field for the name. It is applied when the field loses the focus, since a partly typed name may equal that of another phenomenon.
fn rename_ui(ui: &mut Ui, session: &mut Session, entry: &PhenomenonEntry) {
    let draft_id = ui.scope_id().with("name");
    let mut name = ui.data(|data| data.get_temp::<String>(draft_id)).unwrap_or_else(|| entry.name.clone());
    ui.horizontal(|ui| {
        let label = ui.label("Name").id;
        let field = ui.add(egui::TextEdit::singleline(&mut name).desired_width(120.0)).labelled_by(label);
        if field.changed() {
            ui.data_mut(|data| data.insert_temp(draft_id, name.clone()));
        }
        if field.lost_focus() {
            ui.data_mut(|data| data.remove::<String>(draft_id));
            if !name.trim().is_empty() && name != entry.name {
                let path = entry.id.path().key("name");
                session.edit("rename", &[Operation::Set { path, value: Value::Text(name.trim().to_owned()) }]);
                ui.close();
            }
        }
    });
}
