//! Every parameter of what is chosen, made from the descriptors: the one list that parser, book and schema read too.

use bansho::{
    base::parameters::{Descriptor, Kind, TableDescriptor, Value},
    render::scene::{Place, operation::Operation},
};
use eframe::egui::{Align, CollapsingHeader, Label, Layout, Response, RichText, Ui, vec2};

use super::{
    icon::{self, Icon},
    keyed,
    scene_panel::Subject,
    session::Session,
    value::{Widget, somewhere_in},
};

/// Shows the parameters of `subject`.
pub(super) fn show(ui: &mut Ui, session: &mut Session, subject: &Subject) {
    let Some(descriptor) = subject.descriptor() else { return };
    let place = subject.place();
    ui.heading(subject.title(&session.document));
    ui.weak(&descriptor.doc);
    ui.separator();
    if subject.index.is_some() && subject.place().find(session.document.values()).is_none() {
        ui.label("It is not in the scene any more.");
        return;
    }
    table(ui, session, &place, descriptor);
}

fn table(ui: &mut Ui, session: &mut Session, place: &Place, descriptor: &TableDescriptor) {
    for parameter in &descriptor.parameters {
        let own = place.key(parameter.key);
        match &parameter.kind {
            Kind::Table(inner) => section(ui, session, &own, parameter.key, inner()),
            Kind::List { item, .. } => list(ui, session, &own, parameter, item),
            _ => row(ui, session, &own, parameter),
        }
    }
}

fn section(ui: &mut Ui, session: &mut Session, place: &Place, title: &str, descriptor: &TableDescriptor) {
    let header = CollapsingHeader::new(words(title)).id_salt(place).show(ui, |ui| {
        table(ui, session, place, descriptor);
    });
    header.header_response.on_hover_text(&descriptor.doc);
}

/// The items of a list; tables among them are sections.
fn list(ui: &mut Ui, session: &mut Session, place: &Place, parameter: &Descriptor, item: &Kind) {
    let stated = place.find(session.document.values()).map(|node| node.value.clone());
    let items = match stated.or_else(|| parameter.default.clone()) {
        Some(Value::List(items)) => items,
        _ => Vec::new(),
    };
    let header = CollapsingHeader::new(words(parameter.key)).id_salt(place).show(ui, |ui| {
        for (index, node) in items.iter().enumerate() {
            list_item(ui, session, &place.index(index), item, &node.value);
        }
        if ui.button(format!("Add to {}", words(parameter.key))).clicked() {
            session.edit("add", &[Operation::Append { place: place.clone(), value: somewhere_in(item) }]);
        }
    });
    header.header_response.on_hover_text(&parameter.doc);
}

fn list_item(ui: &mut Ui, session: &mut Session, place: &Place, kind: &Kind, value: &Value) {
    ui.horizontal(|ui| {
        if icon::button(ui, Icon::Cross, &format!("Remove {place}")).clicked() {
            session.edit("remove", &[Operation::Remove { place: place.clone() }]);
        }
        match kind {
            Kind::Table(inner) => section(ui, session, place, &place.to_string(), inner()),
            kind => {
                let label = ui.label(place.to_string()).id;
                if let Some(value) = (Widget { kind, unit: "", label, usual: None }).show(ui, value) {
                    session.set(&place.to_string(), place, value);
                }
            }
        }
    });
}

/// One parameter: its name, its value at the present time, its key, and the way back to its default.
fn row(ui: &mut Ui, session: &mut Session, place: &Place, parameter: &Descriptor) {
    let stated = place.find(session.document.values()).map(|node| node.value.clone());
    let time = session.transport.time_s();
    let present = stated.as_ref().or(parameter.default.as_ref()).and_then(|value| keyed::at(value, time));
    let curve = matches!(parameter.kind, Kind::Curve { .. });
    let name = RichText::new(words(parameter.key));
    let name = if stated.is_some() { name.strong() } else { name };
    ui.horizontal_wrapped(|ui| {
        let label = name_column(ui, name).on_hover_text(help(parameter)).id;
        let Some(present) = present else {
            if ui.button("Set").labelled_by(label).clicked() {
                session.edit(
                    parameter.key,
                    &[Operation::Set { place: place.clone(), value: somewhere_in(&parameter.kind) }],
                );
            }
            return;
        };
        if curve {
            reset(ui, session, place, parameter, stated.is_some());
            ui.end_row();
        }
        let usual = parameter.default.as_ref();
        let widget = Widget { kind: &parameter.kind, unit: parameter.unit, label, usual };
        if let Some(value) = widget.show(ui, &present) {
            session.set(parameter.key, place, value);
        }
        if parameter.animatable() {
            key_button(ui, session, place, stated.as_ref(), present);
        }
        if !curve {
            reset(ui, session, place, parameter, stated.is_some());
        }
    });
}

/// The name in a column of its own, so that values stand under one another.
fn name_column(ui: &mut Ui, name: RichText) -> Response {
    const WIDTH: f32 = 118.0;
    let size = vec2(WIDTH, ui.spacing().interact_size.y);
    let layout = Layout::left_to_right(Align::Center);
    ui.allocate_ui_with_layout(size, layout, |ui| {
        ui.set_min_width(WIDTH);
        ui.add(Label::new(name).truncate())
    })
    .inner
}

fn reset(ui: &mut Ui, session: &mut Session, place: &Place, parameter: &Descriptor, stated: bool) {
    let name = format!("Default of {}", words(parameter.key));
    if stated && icon::button(ui, Icon::Reset, &name).clicked() {
        session.edit("default", &[Operation::Remove { place: place.clone() }]);
    }
}

/// A diamond: full where a key stands at the present time. It makes one or takes it out.
fn key_button(ui: &mut Ui, session: &mut Session, place: &Place, stated: Option<&Value>, present: Value) {
    let time = session.transport.time_s();
    let half = 0.5 * session.transport.frame_s();
    let keys = stated.map(keyed::keys).unwrap_or_default();
    let here = keys.iter().map(|(own, _)| *own).find(|own| (own - time).abs() < half);
    let (sign, doc) = match here {
        Some(_) => (Icon::KeyHere, "Take out the key at this time"),
        None if keys.is_empty() => (Icon::Key, "Key the value at this time"),
        None => (Icon::Keyed, "Keyed; key the value at this time"),
    };
    if icon::button(ui, sign, &format!("{doc}: {place}")).clicked() {
        let operation = match here {
            Some(time) => Operation::RemoveKeyframe { place: place.clone(), time },
            None => session.keyframe(place, present),
        };
        session.edit("key", &[operation]);
    }
}

/// What a parameter is, its unit and what it may be, as the book says it.
fn help(parameter: &Descriptor) -> String {
    let unit = if parameter.unit.is_empty() { String::new() } else { format!(" [{}]", parameter.unit) };
    format!("{}{unit}\n\nAllowed: {}.", parameter.doc, parameter.kind.expectation())
}

/// A key in words.
fn words(key: &str) -> String {
    key.replace('_', " ")
}
