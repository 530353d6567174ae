//! result.json without what two equal runs may differ in: seconds, on the wall and of the processor, and peak memory.

use serde_json::Value;

/// Removes times, memory and the number of threads; the seconds of a trace become null.
pub fn strip(value: &mut Value) {
    match value {
        Value::Object(entries) => {
            for key in ["seconds", "processor_seconds", "peak_memory_bytes", "threads"] {
                entries.remove(key);
            }
            if let Some(Value::Array(trace)) = entries.get_mut("trace") {
                trace.iter_mut().for_each(|point| point[0] = Value::Null);
            }
            entries.values_mut().for_each(strip);
        }
        Value::Array(items) => items.iter_mut().for_each(strip),
        _ => {}
    }
}
