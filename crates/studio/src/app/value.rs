//! Widgets for values, one for each kind of parameter. They know nothing of scenes.

use bansho::base::parameters::{Choice, Kind, Node, Value};
use eframe::egui::{self, DragValue, Id, Ui};

use super::curve_editor;

/// What a value is edited with.
pub(super) struct Widget<'a> {
    /// What it may be.
    pub(super) kind: &'a Kind,
    /// Its unit.
    pub(super) unit: &'a str,
    /// The label that names it, for screen readers.
    pub(super) label: Id,
}

impl Widget<'_> {
    /// Shows `value`; what it becomes where a hand changed it.
    pub(super) fn show(&self, ui: &mut Ui, value: &Value) -> Option<Value> {
        match self.kind {
            Kind::Bool => self.checkbox(ui, value),
            Kind::Integer { min, max } => self.integer(ui, value, [*min, *max]),
            Kind::Number { min, max } => {
                let number = self.number(ui, value.as_number()?, [*min, *max])?;
                Some(Value::Number(number))
            }
            Kind::Vector { min, max, .. } => self.vector(ui, value, [*min, *max]),
            Kind::Text | Kind::Asset | Kind::Rational { .. } => self.text(ui, value),
            Kind::Choice(choices) => self.choice(ui, value, choices),
            Kind::Curve { x, y, .. } => curve_editor::show(ui, self.label, value, [*x, *y]),
            Kind::Animated(inner) | Kind::Optional(inner) => Widget { kind: inner, ..*self }.show(ui, value),
            Kind::Auto(inner) => self.auto(ui, value, inner),
            Kind::List { .. } | Kind::Table(_) => {
                ui.weak("in the text");
                None
            }
        }
    }

    fn checkbox(&self, ui: &mut Ui, value: &Value) -> Option<Value> {
        let mut on = *value == Value::Bool(true);
        let changed = ui.checkbox(&mut on, "").labelled_by(self.label).changed();
        changed.then_some(Value::Bool(on))
    }

    fn integer(&self, ui: &mut Ui, value: &Value, [min, max]: [i64; 2]) -> Option<Value> {
        let mut number = value.as_number()? as i64;
        let drag = DragValue::new(&mut number).range(min..=max).suffix(self.suffix());
        let changed = ui.add(drag).labelled_by(self.label).changed();
        changed.then_some(Value::Integer(number))
    }

    fn number(&self, ui: &mut Ui, mut number: f64, [min, max]: [f64; 2]) -> Option<f64> {
        let speed = speed(number);
        let drag = DragValue::new(&mut number).range(min..=max).speed(speed).max_decimals(4);
        let changed = ui.add(drag.suffix(self.suffix())).labelled_by(self.label).changed();
        changed.then(|| decimal(number))
    }

    fn suffix(&self) -> String {
        if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) }
    }

    fn vector(&self, ui: &mut Ui, value: &Value, bounds: [f64; 2]) -> Option<Value> {
        let Value::List(items) = value else { return None };
        let whole = items.iter().all(|item| matches!(item.value, Value::Integer(_)));
        let part = Self { unit: "", ..*self };
        let mut edited = items.clone();
        let mut changed = false;
        ui.horizontal(|ui| {
            for item in &mut edited {
                let Some(number) = item.value.as_number() else { continue };
                if let Some(number) = part.number(ui, number, bounds) {
                    changed = true;
                    item.value = if whole { Value::Integer(number.round() as i64) } else { Value::Number(number) };
                }
            }
            ui.weak(self.unit);
        });
        changed.then_some(Value::List(edited))
    }

    fn text(&self, ui: &mut Ui, value: &Value) -> Option<Value> {
        let mut text = match value {
            Value::Text(text) => text.clone(),
            number => number.to_string(),
        };
        let changed = ui.text_edit_singleline(&mut text).labelled_by(self.label).changed();
        let number = || text.parse::<f64>().ok().filter(|_| matches!(self.kind, Kind::Rational { .. }));
        changed.then(|| number().map_or_else(|| Value::Text(text.clone()), Value::Number))
    }

    fn choice(&self, ui: &mut Ui, value: &Value, choices: &[Choice]) -> Option<Value> {
        let Value::Text(name) = value else { return None };
        let mut chosen = None;
        let combo = egui::ComboBox::from_id_salt(self.label).selected_text(name.as_str()).show_ui(ui, |ui| {
            for choice in choices {
                if ui.selectable_label(choice.name == name, choice.name).on_hover_text(choice.doc).clicked() {
                    chosen = Some(Value::Text(choice.name.to_owned()));
                }
            }
        });
        combo.response.labelled_by(self.label);
        chosen
    }

    fn auto(&self, ui: &mut Ui, value: &Value, inner: &Kind) -> Option<Value> {
        let mut auto = *value == Value::Text("auto".into());
        let mut edited = None;
        ui.horizontal(|ui| {
            if ui.checkbox(&mut auto, "auto").changed() {
                edited = Some(if auto { Value::Text("auto".into()) } else { somewhere_in(inner) });
            } else if !auto {
                edited = Widget { kind: inner, ..*self }.show(ui, value);
            }
        });
        edited
    }
}

/// A value that `kind` allows, to begin with where nothing better is known.
pub(super) fn somewhere_in(kind: &Kind) -> Value {
    match kind {
        Kind::Bool => Value::Bool(false),
        Kind::Integer { min, max } => Value::Integer(1.clamp(*min, *max)),
        Kind::Number { min, max } | Kind::Rational { min, max } => Value::Number(1.0_f64.clamp(*min, *max)),
        Kind::Vector { length, min, max } => Value::numbers(vec![0.0_f64.clamp(*min, *max); *length]),
        Kind::Text | Kind::Asset => Value::Text(String::new()),
        Kind::Choice(choices) => Value::Text(choices.first().map_or_else(String::new, |choice| choice.name.into())),
        Kind::Curve { x, y, .. } => {
            let point = |x: f64| Node::from(Value::numbers([x, y[1]]));
            Value::List(vec![point(x[0]), point(x[1])])
        }
        Kind::Animated(inner) | Kind::Optional(inner) | Kind::Auto(inner) => somewhere_in(inner),
        Kind::List { .. } => Value::List(Vec::new()),
        Kind::Table(_) => Value::Table(bansho::base::parameters::Table::default()),
    }
}

/// What a pixel of dragging changes a number by: a hundredth of it, and never nothing.
fn speed(number: f64) -> f64 {
    (number.abs() * 0.01).max(0.002)
}

/// The number to the places that a person would write: a file is read by people too.
fn decimal(number: f64) -> f64 {
    let rounded = (number * 10_000.0).round() / 10_000.0;
    // Numbers so small that nothing would be left of them keep all their places.
    if rounded == 0.0 || !rounded.is_finite() { number } else { rounded }
}
