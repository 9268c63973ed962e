//! Value editors, one for each kind of parameter.

use bansho::base::parameters::{Choice, Kind, Node, Value};
use eframe::egui::{self, Color32, DragValue, Id, Ui};

use super::curve_editor::{self, CurveBounds};

/// An editor of one value.
pub(crate) struct ValueEditor<'a> {
    /// The allowed values.
    pub(crate) kind: &'a Kind,
    /// Its unit.
    pub(crate) unit: &'a str,
    /// The label that names it, for screen readers.
    pub(crate) label: Id,
    /// The default value: sliders are finest around it.
    pub(crate) default: Option<&'a Value>,
}

/// Width of the number field, without its unit, and of the buttons beside a slider, points.
const NUMBER_WIDTH: f32 = 114.0;

/// Smallest width of a slider, points.
const MIN_SLIDER_WIDTH: f32 = 40.0;

impl ValueEditor<'_> {
    /// Shows `value`. Returns the new value if it was edited.
    pub(crate) fn ui(&self, ui: &mut Ui, value: &Value) -> Option<Value> {
        match self.kind {
            Kind::Bool => self.checkbox_ui(ui, value),
            Kind::Integer { min, max } => self.integer_ui(ui, value, [*min, *max]),
            Kind::Number { min, max } => {
                let default = self.default.and_then(Value::as_number);
                let number = self.number_ui(ui, value.as_number()?, [*min, *max], default)?;
                Some(Value::Number(number))
            }
            Kind::Vector { min, max, .. } => self.vector_ui(ui, value, [*min, *max]),
            Kind::Text | Kind::Asset | Kind::Rational { .. } => self.text_ui(ui, value),
            Kind::Choice(choices) => self.choice_ui(ui, value, choices),
            Kind::Curve { x, y, rising } => {
                curve_editor::curve_editor_ui(ui, self.label, value, CurveBounds { x: *x, y: *y, rising: *rising })
            }
            Kind::Animated(inner) | Kind::Optional(inner) => ValueEditor { kind: inner, ..*self }.ui(ui, value),
            Kind::Auto(inner) => self.auto_ui(ui, value, inner),
            Kind::List { .. } | Kind::Table(_) => {
                ui.weak("in the text");
                None
            }
        }
    }

    fn checkbox_ui(&self, ui: &mut Ui, value: &Value) -> Option<Value> {
        let mut on = *value == Value::Bool(true);
        let changed = ui.checkbox(&mut on, "").labelled_by(self.label).changed();
        changed.then_some(Value::Bool(on))
    }

    fn integer_ui(&self, ui: &mut Ui, value: &Value, [min, max]: [i64; 2]) -> Option<Value> {
        let mut number = value.as_number()? as i64;
        let bounds = [min as f64, max as f64];
        let default = self.default.and_then(Value::as_number);
        let slid = self.slider_ui(ui, number as f64, bounds, default).map(|slid| slid.round() as i64);
        let drag = DragValue::new(&mut number).range(min..=max).clamp_existing_to_range(false).suffix(self.suffix());
        let dragged = ui.add(drag).labelled_by(self.label).changed().then_some(number);
        slid.or(dragged).map(Value::Integer)
    }

    fn number_ui(&self, ui: &mut Ui, number: f64, bounds: [f64; 2], default: Option<f64>) -> Option<f64> {
        let slid = self.slider_ui(ui, number, bounds, default).map(round_to_4_decimals);
        let dragged = self.drag_ui(ui, number, bounds);
        slid.or(dragged)
    }

    fn drag_ui(&self, ui: &mut Ui, mut number: f64, [min, max]: [f64; 2]) -> Option<f64> {
        let speed = drag_speed(number);
        let drag = DragValue::new(&mut number).range(min..=max).speed(speed).max_decimals(4);
        // A value out of bounds is reported as a problem; showing it must not change it.
        let drag = drag.clamp_existing_to_range(false);
        let changed = ui.add(drag.suffix(self.suffix())).labelled_by(self.label).changed();
        changed.then(|| round_to_4_decimals(number))
    }

    /// A slider over the allowed range, logarithmic where that spans orders of magnitude; `None` without bounds.
    fn slider_ui(&self, ui: &mut Ui, mut number: f64, bounds: [f64; 2], default: Option<f64>) -> Option<f64> {
        let scale = SliderScale::for_bounds(bounds, default)?;
        let unit =
            ui.painter().layout_no_wrap(self.suffix(), egui::TextStyle::Button.resolve(ui.style()), Color32::WHITE);
        let beside = NUMBER_WIDTH + unit.size().x;
        ui.spacing_mut().slider_width = (ui.available_size_before_wrap().x - beside).max(MIN_SLIDER_WIDTH);
        let slider = egui::Slider::new(&mut number, bounds[0]..=bounds[1]).show_value(false);
        let slider = slider.clamping(egui::SliderClamping::Edits);
        let slider = match scale {
            SliderScale::Linear => slider,
            SliderScale::Logarithmic { smallest_positive } => {
                slider.logarithmic(true).smallest_positive(smallest_positive)
            }
        };
        ui.add(slider).labelled_by(self.label).changed().then_some(number)
    }

    fn suffix(&self) -> String {
        match self.unit {
            "" => String::new(),
            "degrees" => "°".to_owned(),
            unit => format!(" {unit}"),
        }
    }

    /// Component `index` of the default of a vector.
    fn default_component(&self, index: usize) -> Option<f64> {
        match self.default {
            Some(Value::List(items)) => items.get(index)?.value.as_number(),
            _ => None,
        }
    }

    /// Component `index` of a vector, which is `item`. Returns whether it was edited.
    fn component_ui(&self, ui: &mut Ui, index: usize, item: &mut Node, bounds: [f64; 2], is_integer: bool) -> bool {
        let Some(number) = item.value.as_number() else { return false };
        let Some(number) = self.number_ui(ui, number, bounds, self.default_component(index)) else { return false };
        item.value = if is_integer { Value::Integer(number.round() as i64) } else { Value::Number(number) };
        true
    }

    /// Numbers in a row; if they have bounds, each in a row of its own with a slider.
    fn vector_ui(&self, ui: &mut Ui, value: &Value, bounds: [f64; 2]) -> Option<Value> {
        let Value::List(items) = value else { return None };
        let is_integer = items.iter().all(|item| matches!(item.value, Value::Integer(_)));
        let mut edited = items.clone();
        let mut changed = false;
        let has_sliders = SliderScale::for_bounds(bounds, self.default_component(0)).is_some();
        let component = Self { unit: if has_sliders { self.unit } else { "" }, ..*self };
        if has_sliders {
            ui.vertical(|ui| {
                for (index, item) in edited.iter_mut().enumerate() {
                    changed |= ui.horizontal(|ui| component.component_ui(ui, index, item, bounds, is_integer)).inner;
                }
            });
        } else {
            ui.horizontal(|ui| {
                for (index, item) in edited.iter_mut().enumerate() {
                    changed |= component.component_ui(ui, index, item, bounds, is_integer);
                }
                ui.weak(self.unit);
            });
        }
        changed.then_some(Value::List(edited))
    }

    fn text_ui(&self, ui: &mut Ui, value: &Value) -> Option<Value> {
        let mut text = match value {
            Value::Text(text) => text.clone(),
            number => number.to_string(),
        };
        let changed = ui.text_edit_singleline(&mut text).labelled_by(self.label).changed();
        // A rational is a number or a fraction in quotes.
        changed.then(|| match text.parse() {
            Ok(number) if matches!(self.kind, Kind::Rational { .. }) => Value::Number(number),
            _ => Value::Text(text),
        })
    }

    fn choice_ui(&self, ui: &mut Ui, value: &Value, choices: &[Choice]) -> Option<Value> {
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

    fn auto_ui(&self, ui: &mut Ui, value: &Value, inner: &Kind) -> Option<Value> {
        let mut auto = *value == Value::Text("auto".into());
        let mut edited = None;
        ui.horizontal(|ui| {
            if ui.checkbox(&mut auto, "auto").changed() {
                edited = Some(if auto { Value::Text("auto".into()) } else { initial_value(inner) });
            } else if !auto {
                edited = ValueEditor { kind: inner, ..*self }.ui(ui, value);
            }
        });
        edited
    }
}

/// A valid value of `kind`, for parameters without a default.
pub(crate) fn initial_value(kind: &Kind) -> Value {
    match kind {
        Kind::Bool => Value::Bool(false),
        Kind::Integer { min, max } => Value::Integer(1.clamp(*min, *max)),
        Kind::Number { min, max } | Kind::Rational { min, max } => Value::Number(1.0_f64.clamp(*min, *max)),
        Kind::Vector { length, min, max } => Value::numbers(vec![0.0_f64.clamp(*min, *max); *length]),
        Kind::Text | Kind::Asset => Value::Text(String::new()),
        Kind::Choice(choices) => Value::Text(choices.first().map_or_else(String::new, |choice| choice.name.into())),
        Kind::Curve { x, y, .. } => {
            // The whole of the greater value, from one end to the other.
            Value::List(x.map(|x| Node::from(Value::numbers([x, y[1]]))).into())
        }
        Kind::Animated(inner) | Kind::Optional(inner) | Kind::Auto(inner) => initial_value(inner),
        Kind::List { .. } => Value::List(Vec::new()),
        Kind::Table(_) => Value::Table(bansho::base::parameters::Table::default()),
    }
}

/// The scale of a slider.
#[derive(Clone, Copy, Debug, PartialEq)]
enum SliderScale {
    Linear,
    /// Logarithmic down to `smallest_positive`.
    Logarithmic {
        smallest_positive: f64,
    },
}

impl SliderScale {
    /// The scale for the range `[min, max]` with a default value; `None` for ranges that are too wide for a slider.
    fn for_bounds([min, max]: [f64; 2], default: Option<f64>) -> Option<Self> {
        /// Wider ranges have no slider.
        const MAX_SPAN: f64 = 2e6;
        /// Ranges with a larger ratio are logarithmic.
        const LOGARITHMIC_RATIO: f64 = 50.0;
        if !(min < max && max - min < MAX_SPAN) {
            return None;
        }
        let default = default.filter(|default| *default > 0.0);
        let wide = match default {
            Some(default) => max / default >= LOGARITHMIC_RATIO,
            None => min > 0.0 && max / min >= LOGARITHMIC_RATIO,
        };
        let smallest_positive = if min > 0.0 { min } else { default.map_or(1e-6 * max, |default| 1e-3 * default) };
        Some(if wide { Self::Logarithmic { smallest_positive } } else { Self::Linear })
    }
}

/// Change per point of dragging: 1 % of the number, at least 0.002.
fn drag_speed(number: f64) -> f64 {
    (number.abs() * 0.01).max(0.002)
}

/// The number rounded to 4 decimals, so that files stay readable.
fn round_to_4_decimals(number: f64) -> f64 {
    let rounded = (number * 10_000.0).round() / 10_000.0;
    // Numbers that would be rounded to 0 keep all digits.
    if rounded == 0.0 || !rounded.is_finite() { number } else { rounded }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sliders_of_wide_ranges_are_logarithmic() {
        assert_eq!(SliderScale::for_bounds([0.0, 1.0], Some(0.5)), Some(SliderScale::Linear));
        assert_eq!(SliderScale::for_bounds([-40.0, 40.0], None), Some(SliderScale::Linear));
        assert_eq!(
            SliderScale::for_bounds([0.0, 1000.0], Some(2.0)),
            Some(SliderScale::Logarithmic { smallest_positive: 0.002 })
        );
        assert_eq!(
            SliderScale::for_bounds([0.01, 100.0], None),
            Some(SliderScale::Logarithmic { smallest_positive: 0.01 })
        );
        assert_eq!(SliderScale::for_bounds([f64::MIN, f64::MAX], Some(1.0)), None);
        assert_eq!(SliderScale::for_bounds([1.0, 1.0], None), None);
    }
}
