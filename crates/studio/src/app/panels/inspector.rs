//! The inspector: every parameter of the selected table, generated from the descriptors.

use bansho::{
    base::parameters::{Descriptor, Kind, PAPER_HEADING, TableDescriptor, Value},
    scene::{ValuePath, operation::Operation},
};

use crate::{
    app::widgets::{
        icon::{self, Icon},
        key_label,
        value::{ValueEditor, initial_value},
    },
    document::{keyframes, phenomena::implies_one_item},
    session::{Session, selection::Selection},
};

use eframe::egui::{Align, CollapsingHeader, Label, Layout, Response, RichText, TextEdit, Ui, vec2};

/// The panel and its search text.
#[derive(Default)]
pub(crate) struct Inspector {
    filter: String,
}

impl Inspector {
    /// Shows the parameters of `selection`: all, or those whose names or descriptions contain the search text.
    pub(crate) fn ui(&mut self, ui: &mut Ui, session: &mut Session, selection: &Selection) {
        let Some(descriptor) = selection.descriptor() else { return };
        let path = selection.path();
        ui.heading(selection.title(&session.document));
        ui.weak(&descriptor.doc);
        ui.horizontal(|ui| {
            let label = ui.label("Find").id;
            let field = TextEdit::singleline(&mut self.filter).hint_text("a parameter").desired_width(f32::INFINITY);
            ui.add(field).labelled_by(label);
        });
        ui.separator();
        if selection.index.is_some() && selection.path().find(session.document.values()).is_none() {
            ui.label("It is not in the scene any more.");
            return;
        }
        let filter = SearchFilter::new(&self.filter);
        if !filter.matches_table(descriptor) {
            ui.weak("Nothing here is called so.");
        }
        table_ui(ui, session, &path, descriptor, &filter);
    }
}

/// A search text; empty matches everything.
struct SearchFilter(String);

impl SearchFilter {
    fn new(text: &str) -> Self {
        Self(text.trim().to_lowercase())
    }

    fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether a parameter, or any within it, matches.
    fn matches(&self, parameter: &Descriptor) -> bool {
        let inside = match &parameter.kind {
            Kind::Table(inner) => self.matches_table(inner()),
            Kind::List { item, .. } => matches!(&**item, Kind::Table(inner) if self.matches_table(inner())),
            _ => false,
        };
        let own = [&key_label(parameter.key), &*parameter.doc];
        inside || own.iter().any(|text| text.to_lowercase().contains(&self.0))
    }

    fn matches_table(&self, table: &TableDescriptor) -> bool {
        table.parameters.iter().any(|parameter| self.matches(parameter))
    }
}

fn table_ui(ui: &mut Ui, session: &mut Session, path: &ValuePath, descriptor: &TableDescriptor, filter: &SearchFilter) {
    // A section that matches by its own name or description is shown as a whole.
    let all = SearchFilter(String::new());
    let filter = if filter.matches_table(descriptor) { filter } else { &all };
    let [for_pictures, for_paper] = descriptor.by_purpose();
    for parameter in for_pictures.into_iter().filter(|parameter| filter.matches(parameter)) {
        parameter_ui(ui, session, path, parameter, filter);
    }
    let mut for_paper = for_paper.into_iter().filter(|parameter| filter.matches(parameter)).peekable();
    if for_paper.peek().is_some() {
        ui.add_space(6.0);
        ui.weak(PAPER_HEADING);
    }
    for parameter in for_paper {
        parameter_ui(ui, session, path, parameter, filter);
    }
}

/// One parameter of the table at `path`.
fn parameter_ui(ui: &mut Ui, session: &mut Session, path: &ValuePath, parameter: &Descriptor, filter: &SearchFilter) {
    let path = path.key(parameter.key);
    match &parameter.kind {
        Kind::Table(inner) => section_ui(ui, session, &path, parameter.key, inner(), filter),
        Kind::List { item, .. } => list_ui(ui, session, &path, parameter, item, filter),
        _ => row_ui(ui, session, &path, parameter),
    }
}

/// A collapsing header that is open while searching.
fn header(title: &str, path: &ValuePath, filter: &SearchFilter) -> CollapsingHeader {
    CollapsingHeader::new(key_label(title)).id_salt(path).open((!filter.is_empty()).then_some(true))
}

fn section_ui(
    ui: &mut Ui,
    session: &mut Session,
    path: &ValuePath,
    title: &str,
    descriptor: &TableDescriptor,
    filter: &SearchFilter,
) {
    let shown = header(title, path, filter).show(ui, |ui| {
        table_ui(ui, session, path, descriptor, filter);
    });
    shown.header_response.on_hover_text(&descriptor.doc);
}

/// The items of a list; tables among them are sections.
fn list_ui(
    ui: &mut Ui,
    session: &mut Session,
    path: &ValuePath,
    parameter: &Descriptor,
    item: &Kind,
    filter: &SearchFilter,
) {
    let shown = header(parameter.key, path, filter).show(ui, |ui| {
        let stated = path.find(session.document.values()).map(|node| node.value.clone());
        let is_stated = stated.is_some();
        let items = match stated.or_else(|| parameter.default.clone()) {
            Some(Value::List(items)) => items,
            _ => Vec::new(),
        };
        // An item of a default list can only be changed after the scene states the list.
        let state_list = Operation::Set { path: path.clone(), value: Value::List(items.clone()) };
        let before = if is_stated || items.is_empty() { Vec::new() } else { vec![state_list] };
        if let (true, Kind::Table(inner)) = (items.is_empty() && implies_one_item(path), item) {
            // Editing the implied item states it in the scene.
            let implied = path.index(0);
            section_ui(ui, session, &implied, &format!("{implied}, as usual"), inner(), filter);
        }
        for (index, node) in items.iter().enumerate() {
            list_item_ui(ui, session, &path.index(index), item, &node.value, filter, &before);
        }
        if ui.button(format!("Add to {}", key_label(parameter.key))).clicked() {
            let append = Operation::Append { path: path.clone(), value: initial_value(item) };
            session.edit("add", &[before.as_slice(), &[append]].concat());
        }
    });
    shown.header_response.on_hover_text(&parameter.doc);
}

/// An item of a list. Every edit first applies the operations `before`, which state the list.
fn list_item_ui(
    ui: &mut Ui,
    session: &mut Session,
    path: &ValuePath,
    kind: &Kind,
    value: &Value,
    filter: &SearchFilter,
    before: &[Operation],
) {
    ui.horizontal(|ui| {
        if icon::button_ui(ui, Icon::Cross, &format!("Remove {path}")).clicked() {
            session.edit("remove", &[before, &[Operation::Remove { path: path.clone() }]].concat());
        }
        match kind {
            Kind::Table(inner) => section_ui(ui, session, path, &path.to_string(), inner(), filter),
            kind => {
                let label = ui.label(path.to_string()).id;
                if let Some(value) = (ValueEditor { kind, unit: "", label, default: None }).ui(ui, value) {
                    session
                        .edit(&path.to_string(), &[before, &[Operation::Set { path: path.clone(), value }]].concat());
                }
            }
        }
    });
}

/// One parameter: its name, its value at the current time, its keyframe button and its reset button.
fn row_ui(ui: &mut Ui, session: &mut Session, path: &ValuePath, parameter: &Descriptor) {
    let stated = path.find(session.document.values()).map(|node| node.value.clone());
    let time = session.transport.time_s();
    let implied_value = session.implied_value(path).or_else(|| parameter.default.clone());
    let present = stated.as_ref().or(implied_value.as_ref()).and_then(|value| keyframes::evaluate_at(value, time));
    let is_curve = matches!(parameter.kind, Kind::Curve { .. });
    let name = RichText::new(key_label(parameter.key));
    let name = if stated.is_some() { name.strong() } else { name };
    ui.horizontal_wrapped(|ui| {
        let label = name_ui(ui, name).on_hover_text(help(parameter)).id;
        let Some(present) = present else {
            if ui.button("Set").labelled_by(label).clicked() {
                session.edit(
                    parameter.key,
                    &[Operation::Set { path: path.clone(), value: initial_value(&parameter.kind) }],
                );
            }
            return;
        };
        if is_curve {
            reset_button_ui(ui, session, path, parameter, stated.is_some());
            ui.end_row();
        }
        let default = parameter.default.as_ref();
        let widget = ValueEditor { kind: &parameter.kind, unit: parameter.unit, label, default };
        if let Some(value) = widget.ui(ui, &present) {
            session.set(parameter.key, path, value);
        }
        if parameter.animatable() {
            key_button_ui(ui, session, path, stated.as_ref(), present);
        }
        if !is_curve {
            reset_button_ui(ui, session, path, parameter, stated.is_some());
        }
    });
}

/// The name in a column of fixed width, so that values are aligned.
fn name_ui(ui: &mut Ui, name: RichText) -> Response {
    const WIDTH: f32 = 118.0;
    let size = vec2(WIDTH, ui.spacing().interact_size.y);
    let layout = Layout::left_to_right(Align::Center);
    ui.allocate_ui_with_layout(size, layout, |ui| {
        ui.set_min_width(WIDTH);
        ui.add(Label::new(name).truncate())
    })
    .inner
}

fn reset_button_ui(ui: &mut Ui, session: &mut Session, path: &ValuePath, parameter: &Descriptor, stated: bool) {
    let name = format!("Default of {}", key_label(parameter.key));
    if stated && icon::button_ui(ui, Icon::Reset, &name).clicked() {
        session.edit("default", &[Operation::Remove { path: path.clone() }]);
    }
}

/// A diamond that adds or removes the keyframe at the current time; filled where there is one.
fn key_button_ui(ui: &mut Ui, session: &mut Session, path: &ValuePath, stated: Option<&Value>, present: Value) {
    let time = session.transport.time_s();
    let half = 0.5 * session.transport.frame_s();
    let keys = stated.map(keyframes::keyframes).unwrap_or_default();
    let here = keys.iter().map(|key| key.time_s).find(|key_s| (key_s - time).abs() < half);
    let (icon, doc) = match here {
        Some(_) => (Icon::KeyframeHere, "Take out the key at this time"),
        None if keys.is_empty() => (Icon::Constant, "Key the value at this time"),
        None => (Icon::Keyframed, "Keyed; key the value at this time"),
    };
    if icon::button_ui(ui, icon, &format!("{doc}: {path}")).clicked() {
        match here {
            Some(time) => session.edit("key", &[Operation::RemoveKeyframe { path: path.clone(), time }]),
            None => session.set_keyframe(path, present),
        }
    }
}

/// The description of a parameter, its unit and the allowed values.
fn help(parameter: &Descriptor) -> String {
    let unit = if parameter.unit.is_empty() { String::new() } else { format!(" [{}]", parameter.unit) };
    format!("{}{unit}\n\nAllowed: {}.", parameter.doc, parameter.kind.expectation())
}
