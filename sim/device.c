// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The life of the device: switched on, lives in milliseconds, reboots.
 *
 * State stands in four places, by what it outlives. The runtime part dies
 * with a reboot; `config` is what the commands set and dies too unless it was
 * saved; `flash` is what 0x50 saved; the bench is the world outside and knows
 * nothing of reboots. A reboot is then four copies and cannot forget a field.
 */
#include "sim/device.h"

#include <string.h>

#include "sim/clock.h"
#include "sim/failsafe.h"

#define SLOTS_MAX 600000u	/* at most ten minutes are lived through in detail */

static const struct {
	uint8_t id;
	const char *name;
} hardwares[] = {
	{ WIRE_HW_56E, "56E" },
	{ WIRE_HW_57U_V11, "57U" },
	{ WIRE_HW_57E_V11, "57E" },
	{ WIRE_HW_57CNC, "57CNC" },
	{ WIRE_HW_57CNCPRO4X25, "57CNCpro4x25" },
	{ WIRE_HW_57CNCDB25, "57CNCdb25" },
};

const char *sim_hardware_name(uint8_t hardware)
{
	for (size_t i = 0; i < sizeof(hardwares) / sizeof(hardwares[0]); i++) {
		if (hardwares[i].id == hardware)
			return hardwares[i].name;
	}
	return NULL;
}

uint8_t sim_hardware_find(const char *name)
{
	for (size_t i = 0; i < sizeof(hardwares) / sizeof(hardwares[0]); i++) {
		if (!strcmp(hardwares[i].name, name))
			return hardwares[i].id;
	}
	return 0;
}

static void take_options(struct sim_device *dev, const struct sim_device_options *options)
{
	static const uint8_t home[4] = { 127, 0, 0, 1 };
	struct sim_device_options *own = &dev->options;

	if (options)
		*own = *options;
	if (!own->hardware)
		own->hardware = WIRE_HW_57CNC;
	if (!own->serial)
		own->serial = 65432;
	if (!own->firmware_major) {
		own->firmware_major = 0x37;
		if (!own->firmware_revision)
			own->firmware_revision = 15;
	}
	if (!own->choices.emergency_base)
		own->choices.emergency_base = 10;
	if (!own->ip[0])
		memcpy(own->ip, home, sizeof(home));
}

static void bench_init(struct sim_bench *bench)
{
	sim_pins_bench_init(&bench->pins);
	sim_machine_init(&bench->machine);
	sim_postep_init(bench->postep);
	sim_bus_bench_init(&bench->bus);
	bench->load_percent = 23;
}

/* Everything a power-up starts from the configuration in RAM. */
static void power_up(struct sim_device *dev)
{
	memset(&dev->run, 0, sizeof(dev->run));
	dev->run.clock_s = dev->options.clock_s;
	dev->run.security_level = dev->config.security.level;
	for (unsigned int i = 0; i < sizeof(dev->run.seed); i++)
		dev->run.seed[i] = (uint8_t)i;
	memset(&dev->analog, 0, sizeof(dev->analog));
	sim_pins_reset(dev);
	sim_encoders_reset(dev);
	sim_panel_reset(dev);
	sim_bus_reset(dev);
	memset(&dev->engine, 0, sizeof(dev->engine));
	sim_engine_start(dev);
	sim_pins_settle(dev);
}

void sim_device_init(struct sim_device *dev, const struct sim_device_options *options)
{
	memset(dev, 0, sizeof(*dev));
	take_options(dev, options);
	bench_init(&dev->bench);
	sim_identity_defaults(dev);
	sim_network_defaults(&dev->config.network, dev->options.ip);
	sim_engine_defaults(&dev->config.engine, dev->options.hardware);
	dev->options.name = NULL;
	dev->factory = dev->config;
	dev->flash = dev->config;
	power_up(dev);
}

void sim_device_save(struct sim_device *dev)
{
	dev->flash = dev->config;
	dev->stats.saves++;
}

void sim_device_reboot(struct sim_device *dev, uint64_t now_ns, bool lose_config)
{
	int64_t clock_s;

	sim_device_advance(dev, now_ns);
	clock_s = sim_clock_seconds(dev);
	if (lose_config)
		dev->flash = dev->factory;
	dev->config = dev->flash;
	dev->stats.reboots++;
	power_up(dev);
	dev->run.boot_ns = now_ns;
	dev->run.heard_ns = now_ns;
	dev->run.clock_s = clock_s;
	dev->run.clock_ns = now_ns;
	dev->run.dead_until_ns = now_ns + UINT64_C(1000000) * dev->options.boot_ms;
	sim_device_log(dev, 1);
}

void sim_device_connected(struct sim_device *dev)
{
	dev->run.security_level = dev->config.security.level;
}

void sim_device_log(struct sim_device *dev, uint16_t entry)
{
	struct sim_runtime *run = &dev->run;

	if (run->log_count == SIM_LOG_ENTRIES)
		memmove(run->log, run->log + 1, sizeof(run->log) - sizeof(run->log[0]));
	else
		run->log_count++;
	run->log[run->log_count - 1] = entry;
}

uint32_t sim_device_tick(const struct sim_device *dev)
{
	return (uint32_t)((dev->now_ns - dev->run.boot_ns) / 1000000);
}

/* Pins which toggle by themselves, to give a monitor something to show. */
static void blink(struct sim_device *dev)
{
	for (uint64_t rest = dev->bench.blinking; rest; rest &= rest - 1) {
		unsigned int pin = (unsigned int)__builtin_ctzll(rest);

		if (dev->stats.slots % dev->bench.blink_ms[pin])
			continue;
		dev->bench.pins.level ^= UINT64_C(1) << pin;
		dev->dirty = true;
	}
}

static void slot(struct sim_device *dev)
{
	dev->stats.slots++;
	blink(dev);
	sim_encoders_slot(dev);
	sim_oven_slot(dev);
	sim_servos_slot(dev);
	sim_analog_slot(dev);
	if (dev->dirty)
		sim_pins_settle(dev);
	sim_engine_slot(dev);
	sim_postep_slot(dev);
	if (dev->dirty)
		sim_pins_settle(dev);
	sim_failsafe_slot(dev);
}

static void start_time(struct sim_device *dev, uint64_t now_ns)
{
	dev->started = true;
	dev->now_ns = now_ns;
	dev->slot_ns = now_ns + SIM_SLOT_NS;
	dev->run.boot_ns = now_ns;
	dev->run.heard_ns = now_ns;
	dev->run.clock_ns = now_ns;
}

void sim_device_advance(struct sim_device *dev, uint64_t now_ns)
{
	if (!dev->started)
		start_time(dev, now_ns);
	if (now_ns < dev->now_ns)
		return;
	if (now_ns - dev->now_ns > UINT64_C(1000000) * SLOTS_MAX)
		dev->slot_ns = now_ns - UINT64_C(1000000) * SLOTS_MAX;
	while (dev->slot_ns <= now_ns) {
		dev->now_ns = dev->slot_ns;
		dev->slot_ns += SIM_SLOT_NS;
		slot(dev);
	}
	dev->now_ns = now_ns;
}
