"""Lesson 2: the drone that flew is not the one in the file. Find out in what, and fly the corrected model."""

import squirrel

believed = squirrel.Vehicle.bundled("squirrel")
# What nobody knows: the rotors of the real drone slow down with the battery.
real = believed.edited({"effects.battery_sag.voltage_exponent": 0.9})
flights = {f"f{k}": squirrel.simulate(vehicle=real, scenario="excite_rich", arm="pc", seed=k) for k in (1, 2, 3)}
held_out = {"f3": flights.pop("f3")}

finding = squirrel.gap.find(vehicle=believed, flights=flights)
worst = finding.where[0]
print(f"worst second: {worst.flight} at {worst.t0_s:.1f} s, {worst.channel}, {worst.condition}")

verdict = squirrel.gap.run(vehicle=believed, flights=flights, held_out=held_out)
print(verdict.words)
for effect in verdict.effects:
    for key, number in effect.parameters.items():
        print(f"{effect.name}.{key} = {number.value} ({number.low} to {number.high})")

assert verdict.patched is not None and [effect.name for effect in verdict.effects] == ["battery_sag"]
verdict.patched.save("squirrel-corrected.toml")
