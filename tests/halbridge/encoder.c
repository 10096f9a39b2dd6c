/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Encoders through the whole exchange: continuity beyond 32 bits, reset,
 * index, scale.
 */
#include "tests/halbridge/rig.h"

static struct rig rig;

static int setup(void **state)
{
	(void)state;
	rig_init(&rig);
	rig_period(&rig);
	return 0;
}

static void position_goes_on_where_the_count_wraps(void **state)
{
	uint32_t raw = 2147483600u;

	(void)state;
	rig_init(&rig);
	rig.values.encoder[3].scale = 100;
	rig.daemon.encoder[3] = (int32_t)raw;
	rig_period(&rig);
	for (uint64_t turn = 0; turn < 10; turn++) {
		for (int step = 0; step < 8; step++) {
			raw += 1u << 29;
			rig.daemon.encoder[3] = (int32_t)raw;
			rig_period(&rig);
		}
	}
	assert_true(rig.values.encoder[3].position == (2147483600.0 + 80.0 * (1u << 29)) / 100);
	assert_int_equal(rig.values.encoder[3].count, (int32_t)raw);
}

static void position_goes_on_below_zero(void **state)
{
	uint32_t raw = 0;

	(void)state;
	for (int step = 0; step < 40; step++) {
		raw -= 1u << 29;
		rig.daemon.encoder[0] = (int32_t)raw;
		rig_period(&rig);
	}
	assert_true(rig.values.encoder[0].position == -40.0 * (1u << 29));
}

static void the_same_sample_twice_counts_once(void **state)
{
	(void)state;
	rig.daemon.encoder[1] = 500;
	rig_period(&rig);
	rig_read(&rig);
	rig_read(&rig);
	assert_int_equal(rig.values.encoder[1].count, 500);
}

static void reset_holds_zero_and_lets_go_without_a_jump(void **state)
{
	(void)state;
	rig.daemon.encoder[2] = 1000;
	rig_period(&rig);
	rig.values.encoder[2].reset = true;
	for (int i = 0; i < 5; i++) {
		rig.daemon.encoder[2] += 10;
		rig_period(&rig);
		assert_int_equal(rig.values.encoder[2].count, 0);
		assert_true(rig.values.encoder[2].position == 0);
	}
	rig.values.encoder[2].reset = false;
	rig.daemon.encoder[2] += 7;
	rig_period(&rig);
	assert_int_equal(rig.values.encoder[2].count, 7);
}

static void reset_leaves_the_device_and_the_others_alone(void **state)
{
	(void)state;
	rig.daemon.encoder[2] = 1000;
	rig.daemon.encoder[4] = 44;
	rig.values.encoder[2].reset = true;
	rig_periods(&rig, 3);
	assert_int_equal(rig.exchange.command.one_shot_head, 0);
	assert_int_equal(rig.values.encoder[4].count, 44);
}

static void scale_may_change_while_running(void **state)
{
	(void)state;
	rig.daemon.encoder[5] = 360;
	rig_period(&rig);
	rig.values.encoder[5].scale = 36;
	rig_period(&rig);
	assert_true(rig.values.encoder[5].position == 10);
	rig.values.encoder[5].scale = -360;
	rig_period(&rig);
	assert_true(rig.values.encoder[5].position == -1);
}

static void a_useless_scale_is_refused_and_the_last_one_stays(void **state)
{
	static const double useless[] = { 0, NAN, INFINITY, -INFINITY };

	(void)state;
	rig.daemon.encoder[5] = 360;
	rig.values.encoder[5].scale = 36;
	rig_period(&rig);
	for (size_t i = 0; i < sizeof(useless) / sizeof(useless[0]); i++) {
		rig.values.encoder[5].scale = useless[i];
		rig_periods(&rig, 3);
		assert_true(rig.values.encoder[5].position == 10);
		assert_true(isfinite(rig.values.encoder[5].velocity));
		assert_true(rig.values.input_refused);
		assert_int_equal(rig.values.input_refused_count, i + 1);
		rig.values.encoder[5].scale = 36;
		rig_period(&rig);
		assert_false(rig.values.input_refused);
	}
}

static void a_refused_scale_leaves_one_note(void **state)
{
	struct refusal_note note;

	(void)state;
	rig.values.encoder[6].scale = 0;
	rig_periods(&rig, 100);
	assert_true(refusal_take(&rig.exchange.refusals, &note));
	assert_int_equal(note.offset, offsetof(struct values, encoder[6].scale));
	assert_int_equal(note.reason, REFUSAL_ZERO);
	assert_false(refusal_take(&rig.exchange.refusals, &note));
}

static void velocity_is_scaled_and_smooth(void **state)
{
	double worst = 0;

	(void)state;
	rig.values.encoder[7].scale = -100;
	for (int i = 0; i < 3000; i++) {
		rig.daemon.encoder[7] = i * 3 / 20; /* 150 counts/s */
		rig_period(&rig);
		if (i > 1000)
			worst = fmax(worst, fabs(rig.values.encoder[7].velocity + 1.5));
	}
	assert_true(worst < 0.05);
}

static void answer(uint32_t id, enum pokeys_outcome outcome)
{
	rig.daemon.one_shot_ack = id + 1;
	rig.daemon.one_shot[id % POKEYS_ONE_SHOT_RESULTS].id = id;
	rig.daemon.one_shot[id % POKEYS_ONE_SHOT_RESULTS].outcome = (uint8_t)outcome;
}

static void index_arms_once_and_clears_at_the_pulse(void **state)
{
	const struct pokeys_command *command = &rig.exchange.command;

	(void)state;
	rig.daemon.encoder[25] = 900;
	rig.values.encoder[25].index_enable = true;
	rig_periods(&rig, 10);
	assert_int_equal(command->one_shot_head, 1);
	assert_int_equal(command->one_shot[0].operation, POKEYS_ONE_SHOT_ARM_INDEX);
	assert_int_equal(command->one_shot[0].index, 25);
	answer(0, POKEYS_OUTCOME_DONE);
	rig_periods(&rig, 10);
	assert_true(rig.values.encoder[25].index_enable);
	rig.daemon.encoder_index = 1u << 25;
	rig.daemon.encoder[25] = 4;
	rig_period(&rig);
	assert_false(rig.values.encoder[25].index_enable);
	assert_int_equal(rig.values.encoder[25].count, 4);
	assert_true(rig.values.encoder[25].position == 4);
	rig_periods(&rig, 10);
	assert_int_equal(command->one_shot_head, 1);
}

static void an_index_flag_from_before_arming_is_not_believed(void **state)
{
	(void)state;
	rig.daemon.encoder[25] = 900;
	rig.daemon.encoder_index = 1u << 25;
	rig.values.encoder[25].index_enable = true;
	rig_periods(&rig, 10);
	assert_true(rig.values.encoder[25].index_enable);
	assert_int_equal(rig.values.encoder[25].count, 900);
}

static void index_zero_undoes_a_local_reset(void **state)
{
	(void)state;
	rig.daemon.encoder[25] = 900;
	rig.values.encoder[25].reset = true;
	rig_period(&rig);
	rig.values.encoder[25].reset = false;
	rig.values.encoder[25].index_enable = true;
	rig_periods(&rig, 2);
	answer(0, POKEYS_OUTCOME_DONE);
	rig.daemon.encoder_index = 1u << 25;
	rig.daemon.encoder[25] = 3;
	rig_period(&rig);
	assert_int_equal(rig.values.encoder[25].count, 3);
}

static void a_refused_arming_is_said_and_tried_again(void **state)
{
	struct refusal_note note;

	(void)state;
	rig.values.encoder[8].index_enable = true;
	rig_periods(&rig, 3);
	answer(0, POKEYS_OUTCOME_REFUSED);
	rig_periods(&rig, 50);
	assert_true(rig.values.encoder[8].index_enable);
	assert_int_equal(rig.values.one_shot_failed_count, 1);
	assert_int_equal(rig.exchange.command.one_shot_head, 1);
	assert_true(refusal_take(&rig.exchange.refusals, &note));
	assert_int_equal(note.offset, offsetof(struct values, encoder[8].index_enable));
	rig_periods(&rig, 100);
	assert_int_equal(rig.exchange.command.one_shot_head, 2);
}

static void a_withdrawn_index_does_not_move_the_position(void **state)
{
	double before;

	(void)state;
	rig.values.encoder[25].index_enable = true;
	rig_periods(&rig, 3);
	answer(0, POKEYS_OUTCOME_DONE);
	for (int i = 0; i < 100; i++) {
		rig.daemon.encoder[25] = 5000 + 20 * i;
		rig_period(&rig);
	}
	rig.values.encoder[25].index_enable = false;
	rig_write(&rig);
	before = rig.values.encoder[25].position;
	rig.daemon.encoder_index = 1u << 25;
	rig.daemon.encoder[25] = 7;
	rig_period(&rig);
	assert_true(fabs(rig.values.encoder[25].position - before - 20) <= 1);
	assert_true(fabs(rig.values.encoder[25].velocity - 20000) < 500);
	rig.daemon.encoder[25] = 27;
	rig_period(&rig);
	assert_true(fabs(rig.values.encoder[25].position - before - 40) <= 1);
	assert_int_equal(rig.exchange.command.one_shot_head, 1);
}

static void a_new_daemon_is_asked_for_the_index_again(void **state)
{
	uint32_t session = rig.exchange.command.session;

	(void)state;
	rig.values.encoder[25].index_enable = true;
	rig_periods(&rig, 3);
	answer(0, POKEYS_OUTCOME_DONE);
	rig_period(&rig);
	rig.daemon.epoch++;
	rig.daemon.one_shot_ack = 0;
	memset(rig.daemon.one_shot, 0, sizeof(rig.daemon.one_shot));
	rig_periods(&rig, 3);
	assert_int_not_equal(rig.exchange.command.session, session);
	assert_int_equal(rig.exchange.command.one_shot_head, 1);
	assert_true(rig.values.encoder[25].index_enable);
}

static uint32_t press_set(unsigned int i, int32_t to)
{
	rig.values.encoder[i].set_value = to;
	rig.values.encoder[i].set = true;
	rig_period(&rig);
	rig.values.encoder[i].set = false;
	return rig.exchange.command.one_shot_head - 1;
}

static void outcome(uint32_t id, enum pokeys_outcome outcome)
{
	rig.daemon.one_shot[id % POKEYS_ONE_SHOT_RESULTS] = (struct pokeys_one_shot_result){
		.id = id,
		.operation = POKEYS_ONE_SHOT_SET_ENCODER,
		.outcome = (uint8_t)outcome,
	};
	rig.daemon.one_shot_ack = id + 1;
}

/* The device's new count may be seen before its outcome is, or after it. */
static void setting_the_counter_is_no_motion(void **state)
{
	const struct value_encoder *value = &rig.values.encoder[3];

	(void)state;
	for (unsigned int early = 0; early < 2; early++) {
		uint32_t id;

		setup(state);
		rig.values.encoder[3].scale = 10;
		rig.daemon.encoder[3] = 500;
		rig_periods(&rig, 3);
		id = press_set(3, -7000);
		assert_int_equal(rig.exchange.command.one_shot[id].index, 3);
		assert_int_equal(rig.exchange.command.one_shot[id].value[0], -7000);
		if (early)
			rig.daemon.encoder[3] = -7000;
		rig_periods(&rig, 5);
		assert_int_equal(value->count, 500);
		rig.device_silent = true; /* nothing newer has come yet */
		outcome(id, POKEYS_OUTCOME_DONE);
		rig_periods(&rig, 2);
		assert_int_equal(value->count, 500);
		rig.device_silent = false;
		rig.daemon.encoder[3] = -6990;
		rig_period(&rig);
		assert_int_equal(value->count, -6990);
		assert_true(value->position == -699 && value->velocity == 0);
		rig.daemon.encoder[3] = -6980;
		rig_periods(&rig, 3);
		assert_int_equal(value->count, -6980);
		assert_int_equal(rig.values.one_shot_failed_count, 0);
	}
}

static void a_counter_that_was_not_set_goes_on(void **state)
{
	static const enum pokeys_outcome outcomes[] = {
		POKEYS_OUTCOME_FAILED,
		POKEYS_OUTCOME_UNKNOWN,
		POKEYS_OUTCOME_REFUSED,
	};

	for (size_t i = 0; i < sizeof(outcomes) / sizeof(outcomes[0]); i++) {
		uint32_t id;

		setup(state);
		rig.daemon.encoder[3] = 500;
		rig_periods(&rig, 3);
		id = press_set(3, -7000);
		outcome(id, outcomes[i]);
		rig_periods(&rig, 2);
		assert_int_equal(rig.values.encoder[3].count, 500);
		rig.daemon.encoder[3] = 510;
		rig_periods(&rig, 2);
		assert_int_equal(rig.values.encoder[3].count, 510);
		assert_int_equal(rig.values.one_shot_failed_count, 1);
	}
}

/* The queue is full: it goes on until the press goes out. */
static void a_counter_counts_while_its_setting_waits(void **state)
{
	(void)state;
	while (rig.exchange.command.one_shot_head < POKEYS_ONE_SHOTS) {
		rig.values.counter.reset = !rig.values.counter.reset;
		rig_period(&rig);
	}
	press_set(3, -7000);
	assert_int_equal(rig.exchange.command.one_shot_head, POKEYS_ONE_SHOTS);
	rig.daemon.encoder[3] = 30;
	rig_periods(&rig, 3);
	assert_int_equal(rig.values.encoder[3].count, 30);
}

/* How the second one ended would not tell what the first one did. */
static void a_counter_is_set_once_at_a_time(void **state)
{
	uint32_t id;

	(void)state;
	rig.daemon.encoder[3] = 500;
	rig_periods(&rig, 3);
	id = press_set(3, -7000);
	rig_period(&rig);
	assert_int_equal(press_set(3, 100), id);
	assert_int_equal(rig.values.one_shot_failed_count, 1);
	rig_period(&rig);
	rig.daemon.encoder[3] = -7000;
	outcome(id, POKEYS_OUTCOME_DONE);
	rig_periods(&rig, 3);
	assert_int_equal(rig.values.encoder[3].count, -7000);
	assert_int_equal(rig.exchange.command.one_shot[press_set(3, 100)].value[0], 100);
}

static void a_counter_is_not_set_while_data_are_old(void **state)
{
	(void)state;
	rig.device_silent = true;
	rig_periods(&rig, 20);
	press_set(3, 100);
	assert_int_equal(rig.exchange.command.one_shot_head, 0);
	assert_int_equal(rig.values.one_shot_failed_count, 1);
}

/* Nobody knows whether it did it. */
static void a_daemon_that_goes_while_setting_moves_nothing(void **state)
{
	(void)state;
	rig.daemon.encoder[3] = 500;
	rig_periods(&rig, 3);
	press_set(3, -7000);
	rig.daemon.epoch++;
	rig.daemon.encoder[3] = -7000;
	rig_periods(&rig, 5);
	assert_int_equal(rig.values.encoder[3].count, 500);
	rig.daemon.encoder[3] = -6990;
	rig_periods(&rig, 5);
	assert_int_equal(rig.values.encoder[3].count, 510);
	assert_int_equal(rig.values.one_shot_failed_count, 1);
}

/* What may happen to one of them between two reads. */
static void disturb(struct value_encoder *value, int32_t *raw, uint64_t *t_ns)
{
	static int speed;

	switch (rand() % 40) {
	case 0:
		speed = rand() % 3 ? rand() % 7 - 3 : 0;
		break;
	case 1:
		value->scale = rand() % 5 - 1;
		break;
	case 2:
		value->reset = rand() % 2;
		break;
	case 3:
		*t_ns += rand() % 3 ? 20 * RIG_MS : 150 * RIG_MS;
		break;
	case 4:
		speed = 0;
		break;
	default:
		break;
	}
	*raw += rand() % 2 ? speed : 0;
	*t_ns += rand() % 10 ? RIG_MS : 0;
}

static void the_short_way_of_a_standing_one_shows_the_same(void **state)
{
	struct value_encoder value = { .scale = 1 }, same;
	struct encoder encoder, slow;
	struct refusals refusals = { 0 };
	struct pokeys_state image = { 0 };
	uint64_t t_ns = RIG_MS;
	unsigned int short_ways = 0;

	(void)state;
	srand(4711);
	encoder_init(&encoder);
	encoder_init(&slow);
	for (unsigned int i = 0; i < 300000; i++) {
		disturb(&value, &image.encoder[0], &t_ns);
		if (i / 2000 % 2) {
			value.reset = false;
			image.encoder[0] = 5; /* it stands for a while */
		}
		image.encoder_t_ns[0] = t_ns;
		if (rand() % 5000 == 0) {
			const bool keep = rand() % 2;

			encoder_restarted(&encoder, keep);
			encoder_restarted(&slow, keep);
		}
		same = value;
		slow.rests = false;
		encoder_read(&slow, &same, 0, &image, true, &refusals);
		if (encoder_stands(&encoder, &value, image.encoder[0], t_ns))
			short_ways++;
		else
			encoder_read(&encoder, &value, 0, &image, true, &refusals);
		assert_memory_equal(&value, &same, sizeof(value));
		assert_true(encoder.total == slow.total && encoder.t_ns == slow.t_ns &&
			    encoder.velocity.t_ns == slow.velocity.t_ns);
	}
	assert_in_range(short_ways, 10000, 290000);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(position_goes_on_where_the_count_wraps, setup),
		cmocka_unit_test_setup(position_goes_on_below_zero, setup),
		cmocka_unit_test_setup(the_same_sample_twice_counts_once, setup),
		cmocka_unit_test_setup(reset_holds_zero_and_lets_go_without_a_jump, setup),
		cmocka_unit_test_setup(reset_leaves_the_device_and_the_others_alone, setup),
		cmocka_unit_test_setup(scale_may_change_while_running, setup),
		cmocka_unit_test_setup(a_useless_scale_is_refused_and_the_last_one_stays, setup),
		cmocka_unit_test_setup(a_refused_scale_leaves_one_note, setup),
		cmocka_unit_test_setup(velocity_is_scaled_and_smooth, setup),
		cmocka_unit_test_setup(index_arms_once_and_clears_at_the_pulse, setup),
		cmocka_unit_test_setup(an_index_flag_from_before_arming_is_not_believed, setup),
		cmocka_unit_test_setup(index_zero_undoes_a_local_reset, setup),
		cmocka_unit_test_setup(a_refused_arming_is_said_and_tried_again, setup),
		cmocka_unit_test_setup(a_withdrawn_index_does_not_move_the_position, setup),
		cmocka_unit_test_setup(a_new_daemon_is_asked_for_the_index_again, setup),
		cmocka_unit_test(setting_the_counter_is_no_motion),
		cmocka_unit_test(a_counter_that_was_not_set_goes_on),
		cmocka_unit_test_setup(a_counter_counts_while_its_setting_waits, setup),
		cmocka_unit_test_setup(a_counter_is_set_once_at_a_time, setup),
		cmocka_unit_test_setup(a_counter_is_not_set_while_data_are_old, setup),
		cmocka_unit_test_setup(a_daemon_that_goes_while_setting_moves_nothing, setup),
		cmocka_unit_test(the_short_way_of_a_standing_one_shows_the_same),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
