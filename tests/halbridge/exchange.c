/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Inputs, outputs, analog values, identity and the one-shot ring through the
 * exchange.
 */
#include "tests/halbridge/rig.h"

static struct rig rig;
static struct values *const values = &rig.values;
static struct pokeys_command *const command = &rig.exchange.command;

static int setup(void **state)
{
	(void)state;
	rig_init(&rig);
	rig_period(&rig);
	return 0;
}

static void every_input_bit_has_its_pin(void **state)
{
	(void)state;
	for (unsigned int bit = 0; bit < POKEYS_PINS; bit++) {
		memset(rig.daemon.digital_in, 0, sizeof(rig.daemon.digital_in));
		rig.daemon.digital_in[bit / 8] = (uint8_t)(1u << bit % 8);
		rig_period(&rig);
		for (unsigned int i = 0; i < POKEYS_PINS; i++) {
			assert_int_equal(values->pin.in[i], i == bit);
			assert_int_equal(values->pin.in_not[i], i != bit);
		}
	}
}

static void every_output_pin_has_its_bit(void **state)
{
	(void)state;
	for (unsigned int pin = 0; pin < POKEYS_PINS; pin++) {
		values->pin.out[pin] = true;
		rig_period(&rig);
		for (unsigned int i = 0; i < POKEYS_PINS; i++)
			assert_int_equal(command->digital_out[i / 8] >> i % 8 & 1, i == pin);
		values->pin.out[pin] = false;
	}
}

static void only_pins_that_are_outputs_are_commanded(void **state)
{
	(void)state;
	values->pin.out[3] = true;
	values->pin.out[9] = true;
	rig_period(&rig);
	assert_int_equal(command->digital_out_mask[0] | command->digital_out_mask[1], 0);
	rig.daemon.digital_out_owned[0] = 0x0c;
	rig_period(&rig);
	assert_int_equal(command->digital_out_mask[0], 0x0c);
	assert_int_equal(command->digital_out_mask[1], 0);
	assert_int_equal(command->digital_out[0] & command->digital_out_mask[0], 0x08);
}

static void analog_is_volts_times_scale_minus_offset(void **state)
{
	(void)state;
	rig.daemon.analog[2] = 2048;
	rig_period(&rig);
	assert_int_equal(values->analog[2].raw, 2048);
	assert_true(fabs(values->analog[2].value - 1.65) < 1e-9);
	values->analog[2].scale = 10;
	values->analog[2].offset = 0.5;
	rig_period(&rig);
	assert_true(fabs(values->analog[2].value - 16.0) < 1e-9);
}

static void analog_never_becomes_nan(void **state)
{
	(void)state;
	rig.daemon.analog[2] = 2048;
	values->analog[2].scale = 10;
	rig_period(&rig);
	values->analog[2].scale = NAN;
	values->analog[2].offset = INFINITY;
	rig_periods(&rig, 3);
	assert_true(fabs(values->analog[2].value - 16.5) < 1e-9);
	assert_true(values->input_refused);
	assert_int_equal(values->input_refused_count, 2);
}

static void identity_and_capabilities_are_shown(void **state)
{
	(void)state;
	rig.daemon.link = POKEYS_LINK_CONFIGURING;
	rig.daemon.identity.serial = 53386;
	rig.daemon.identity.hardware = 32;
	rig.daemon.capability.pins = 55;
	rig.daemon.capability.pulse_engine = 2;
	rig.daemon.capability.pwm_hz = 25000000;
	rig.daemon.capability.joystick = 1;
	rig_period(&rig);
	assert_int_equal(values->device_serial, 53386);
	assert_int_equal(values->info.serial, 53386);
	assert_int_equal(values->info.type_id, 32);
	assert_int_equal(values->info.pins, 55);
	assert_int_equal(values->info.pulse_engine, 0);
	assert_int_equal(values->info.pulse_engine_v2, 1);
	assert_int_equal(values->info.pwm_hz, 25000000);
	assert_int_equal(values->info.joystick_hat, 1);
}

static void the_heartbeat_beats_and_the_times_are_told(void **state)
{
	uint64_t before = command->heartbeat;

	(void)state;
	rig_period(&rig);
	assert_true(command->heartbeat == before + 1);
	assert_true(command->t_ns == rig.now_ns && command->t_thread_ns == rig.now_ns);
	assert_true(command->period_ns == RIG_MS);
	assert_int_equal(command->session, rig.exchange.queue.session);
}

static void the_age_at_each_read_is_told_once(void **state)
{
	const uint32_t *age = command->read_age_ns;

	(void)state;
	rig_period(&rig);
	assert_int_equal(age[command->heartbeat % POKEYS_READ_AGES], 200000);
	/* nothing was read in between */
	rig.now_ns += RIG_MS;
	rig_write(&rig);
	assert_int_equal(age[command->heartbeat % POKEYS_READ_AGES], 0);
	assert_int_equal(age[(command->heartbeat - 1) % POKEYS_READ_AGES], 200000);
	/* old data are no sample: age-us shows them */
	rig.device_silent = true;
	rig_periods(&rig, 10);
	assert_int_equal(age[command->heartbeat % POKEYS_READ_AGES], 0);
	assert_int_equal(age[(command->heartbeat - 7) % POKEYS_READ_AGES], 200000 + 4 * RIG_MS);
}

static void writes_only(unsigned int count)
{
	rig.unread = true;
	rig_periods(&rig, count);
	rig.unread = false;
}

static void switch_on(void)
{
	values->machine_is_on = true;
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		values->joint[i].enable = true;
}

static bool drives(void)
{
	bool any = command->flags & POKEYS_COMMAND_MACHINE_ON;

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		any |= command->axis[i].enable;
	return any;
}

/* What LinuxCNC commands then it does not know from the axes. */
static void writing_without_reading_drives_nothing(void **state)
{
	const uint64_t read_ns = rig.now_ns;

	(void)state;
	rig.daemon.flags |= POKEYS_STATE_MACHINE_ON;
	switch_on();
	rig_period(&rig);
	assert_true(drives() && values->connected && values->machine_on_permitted);
	writes_only(EXCHANGE_UNREAD_MOST - 1);
	assert_true(drives());
	assert_false(values->read_missing);
	writes_only(1);
	assert_false(drives());
	assert_true(values->read_missing && values->stale && values->needs_edge);
	assert_false(values->connected || values->machine_on_permitted);
	assert_true(command->t_thread_ns == read_ns + RIG_MS);
	/* reading again is no edge of machine-is-on */
	rig_periods(&rig, 10);
	assert_false(values->read_missing);
	assert_true(values->connected && values->needs_edge);
	assert_false(command->flags & POKEYS_COMMAND_MACHINE_ON);
	values->machine_is_on = false;
	rig_period(&rig);
	values->machine_is_on = true;
	rig_period(&rig);
	assert_true(command->flags & POKEYS_COMMAND_MACHINE_ON);
	rig_period(&rig);
	assert_false(values->needs_edge);
}

static void nothing_is_pressed_by_one_who_does_not_read(void **state)
{
	(void)state;
	rig_period(&rig);
	writes_only(EXCHANGE_UNREAD_MOST);
	values->engine.clear_fault = true;
	values->joint[0].home = true;
	writes_only(10);
	assert_int_equal(command->one_shot_head, 0);
}

static void who_never_read_drives_nothing(void **state)
{
	(void)state;
	rig_init(&rig);
	rig.exchange.unread_writes = EXCHANGE_UNREAD_MOST;
	switch_on();
	writes_only(10);
	assert_false(drives());
	assert_int_equal(command->t_thread_ns, 0);
}

/* A device that is silent is read all the same, and is the daemon's business. */
static void reading_what_is_stale_is_reading(void **state)
{
	(void)state;
	switch_on();
	rig.device_silent = true;
	rig_periods(&rig, 50);
	assert_true(values->stale && drives());
	assert_false(values->read_missing);
}

static void a_session_is_never_zero(void **state)
{
	(void)state;
	exchange_init(&rig.exchange, 0);
	assert_int_not_equal(command->session, 0);
	exchange_init(&rig.exchange, UINT32_MAX);
	rig.daemon.epoch++;
	rig_period(&rig);
	assert_int_not_equal(command->session, 0);
}

/* So that it holds the outputs, which are commanded on. */
static void another_daemon_is_told_that_we_go_on(void **state)
{
	(void)state;
	rig_periods(&rig, 3);
	assert_false(command->flags & POKEYS_COMMAND_RESUMED);
	rig.daemon.epoch++;
	rig_periods(&rig, 3);
	assert_true(command->flags & POKEYS_COMMAND_RESUMED);
}

static const struct pokeys_one_shot nop = { .operation = POKEYS_ONE_SHOT_NOP };

static void nothing_is_queued_before_the_daemon_knows_us(void **state)
{
	uint32_t id;

	(void)state;
	rig.exchange.state->one_shot_session = 1;
	one_shot_begin(&rig.exchange.queue, command, 99);
	one_shot_acknowledge(&rig.exchange.queue, rig.exchange.state);
	assert_int_equal(one_shot_push(&rig.exchange.queue, command, &nop, &id), ONE_SHOT_NOT_YET);
	rig.exchange.state->one_shot_session = 99;
	one_shot_acknowledge(&rig.exchange.queue, rig.exchange.state);
	assert_int_equal(one_shot_push(&rig.exchange.queue, command, &nop, &id), ONE_SHOT_QUEUED);
	assert_int_equal(id, 0);
}

static void a_full_ring_refuses_at_once_and_takes_again(void **state)
{
	struct one_shot_queue *queue = &rig.exchange.queue;
	uint32_t id;

	(void)state;
	rig_period(&rig);
	for (uint32_t i = 0; i < POKEYS_ONE_SHOTS; i++) {
		assert_int_equal(one_shot_push(queue, command, &nop, &id), ONE_SHOT_QUEUED);
		assert_int_equal(id, i);
		assert_int_equal(command->one_shot[i].id, i);
	}
	assert_int_equal(one_shot_push(queue, command, &nop, &id), ONE_SHOT_FULL);
	values->encoder[0].index_enable = true;
	rig_period(&rig);
	assert_true(values->one_shot_full);
	rig.daemon.one_shot_ack = 1;
	rig_period(&rig);
	assert_false(values->one_shot_full);
	assert_int_equal(command->one_shot[0].id, POKEYS_ONE_SHOTS);
	assert_int_equal(command->one_shot[0].operation, POKEYS_ONE_SHOT_ARM_INDEX);
	assert_int_equal(command->one_shot_head, POKEYS_ONE_SHOTS + 1);
}

static void a_senseless_acknowledgement_is_not_believed(void **state)
{
	struct one_shot_queue *queue = &rig.exchange.queue;
	uint32_t id;

	(void)state;
	rig_period(&rig);
	one_shot_push(queue, command, &nop, &id);
	rig.daemon.one_shot_ack = 5;
	rig_period(&rig);
	assert_int_equal(queue->ack, 0);
	rig.daemon.one_shot_ack = 1;
	rig_period(&rig);
	assert_int_equal(queue->ack, 1);
	rig.daemon.one_shot_ack = 0;
	rig_period(&rig);
	assert_int_equal(queue->ack, 1);
}

static void outcomes_are_told_apart(void **state)
{
	struct one_shot_queue queue = { .session = 5, .head = 20, .open = true };
	struct pokeys_state image = { .one_shot_session = 5 };

	(void)state;
	assert_int_equal(one_shot_outcome(&queue, &image, 3), POKEYS_OUTCOME_NONE);
	image.one_shot[3].id = 3;
	image.one_shot[3].outcome = POKEYS_OUTCOME_DONE;
	assert_int_equal(one_shot_outcome(&queue, &image, 3), POKEYS_OUTCOME_DONE);
	assert_int_equal(one_shot_outcome(&queue, &image, 19), POKEYS_OUTCOME_NONE);
	image.one_shot[3].id = 19;
	assert_int_equal(one_shot_outcome(&queue, &image, 3), POKEYS_OUTCOME_UNKNOWN);
	/* unless it may be the one that goes on */
	image.engine.task_phase = POKEYS_TASK_WORKING;
	assert_int_equal(one_shot_outcome(&queue, &image, 3), POKEYS_OUTCOME_NONE);
	assert_int_equal(one_shot_outcome(&queue, &image, 19), POKEYS_OUTCOME_DONE);
	image.engine.task_phase = POKEYS_TASK_IDLE;
	image.one_shot[3].outcome = 77;
	assert_int_equal(one_shot_outcome(&queue, &image, 19), POKEYS_OUTCOME_UNKNOWN);
	image.one_shot_session = 6;
	assert_int_equal(one_shot_outcome(&queue, &image, 19), POKEYS_OUTCOME_NONE);
}

/* Whatever stands in shared memory: nothing infinite on a pin, nothing crashes. */
static void garbage_in_the_state_makes_no_nan(void **state)
{
	uint32_t random = 12345;

	(void)state;
	for (int round = 0; round < 20000; round++) {
		unsigned char *bytes = (unsigned char *)rig.exchange.state;

		for (size_t i = 0; i < sizeof(*rig.exchange.state); i++) {
			random = random * 1664525u + 1013904223u;
			bytes[i] = (unsigned char)(random >> 24);
		}
		rig.now_ns += RIG_MS;
		if (round % 2) {
			rig.exchange.state->link = POKEYS_LINK_RUNNING;
			rig.exchange.state->flags &= ~(uint32_t)POKEYS_STATE_STALE;
			rig.exchange.state->t_digital_ns = rig.now_ns;
			rig.exchange.state->t_motion_ns = 0;
		}
		exchange_read(&rig.exchange, values, EXCHANGE_STATE, rig.now_ns);
		rig_write(&rig);
		for (unsigned int i = 0; i < POKEYS_ENCODERS; i++) {
			assert_true(isfinite(values->encoder[i].position));
			assert_true(isfinite(values->encoder[i].velocity));
		}
		for (unsigned int i = 0; i < POKEYS_AXES; i++)
			assert_true(isfinite(values->joint[i].pos_fb));
		assert_true(isfinite(values->age_us));
	}
}

static void no_factor_makes_an_infinity(void **state)
{
	static const double factors[] = {
		1e-310, -1e-310, 1e-300, 1e308, -1e308, 1e-99, -1e-99, 1e99, -1e99, 1,
	};

	(void)state;
	for (size_t i = 0; i < sizeof(factors) / sizeof(factors[0]); i++) {
		for (unsigned int k = 0; k < POKEYS_ENCODERS; k++)
			values->encoder[k].scale = factors[i];
		for (unsigned int k = 0; k < POKEYS_AXES; k++)
			values->joint[k].scale = factors[i];
		for (unsigned int k = 0; k < POKEYS_ANALOG; k++) {
			values->analog[k].scale = factors[i];
			values->analog[k].offset = -factors[i];
			rig.daemon.analog[k] = 4095;
		}
		for (int period = 0; period < 9; period++) {
			for (unsigned int k = 0; k < POKEYS_ENCODERS; k++)
				rig.daemon.encoder[k] = (int32_t)((uint32_t)rig.daemon.encoder[k] +
								  (1u << 28));
			for (unsigned int k = 0; k < POKEYS_AXES; k++)
				rig.daemon.engine.axis[k].position = INT32_MAX;
			rig_period(&rig);
		}
		for (unsigned int k = 0; k < POKEYS_ENCODERS; k++) {
			assert_true(isfinite(values->encoder[k].position));
			assert_true(isfinite(values->encoder[k].velocity));
		}
		for (unsigned int k = 0; k < POKEYS_AXES; k++)
			assert_true(isfinite(values->joint[k].pos_fb));
		for (unsigned int k = 0; k < POKEYS_ANALOG; k++)
			assert_true(isfinite(values->analog[k].value));
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(every_input_bit_has_its_pin, setup),
		cmocka_unit_test_setup(every_output_pin_has_its_bit, setup),
		cmocka_unit_test_setup(only_pins_that_are_outputs_are_commanded, setup),
		cmocka_unit_test_setup(analog_is_volts_times_scale_minus_offset, setup),
		cmocka_unit_test_setup(analog_never_becomes_nan, setup),
		cmocka_unit_test_setup(no_factor_makes_an_infinity, setup),
		cmocka_unit_test_setup(identity_and_capabilities_are_shown, setup),
		cmocka_unit_test_setup(the_heartbeat_beats_and_the_times_are_told, setup),
		cmocka_unit_test_setup(the_age_at_each_read_is_told_once, setup),
		cmocka_unit_test_setup(writing_without_reading_drives_nothing, setup),
		cmocka_unit_test_setup(nothing_is_pressed_by_one_who_does_not_read, setup),
		cmocka_unit_test_setup(who_never_read_drives_nothing, setup),
		cmocka_unit_test_setup(reading_what_is_stale_is_reading, setup),
		cmocka_unit_test_setup(another_daemon_is_told_that_we_go_on, setup),
		cmocka_unit_test_setup(a_session_is_never_zero, setup),
		cmocka_unit_test_setup(nothing_is_queued_before_the_daemon_knows_us, setup),
		cmocka_unit_test_setup(a_full_ring_refuses_at_once_and_takes_again, setup),
		cmocka_unit_test_setup(a_senseless_acknowledgement_is_not_believed, setup),
		cmocka_unit_test_setup(outcomes_are_told_apart, setup),
		cmocka_unit_test_setup(garbage_in_the_state_makes_no_nan, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
