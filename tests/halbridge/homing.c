/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Homing by the device, both ends of the conversation as they are built: the
 * homing module's plan on one side, the exchange with its AxesState and one-shots
 * on the other. Made up is only the daemon behind them: it does what a one-shot
 * says, some periods later.
 */
#include "tests/halbridge/rig.h"
#include "halbridge/home_plan.h"

#define PERIOD_S 0.001
#define JOINTS 3

static struct rig rig;
static struct home_plan plan;
static struct home_result seen;
static uint32_t answered;         /* one-shots the made-up daemon has done */
static unsigned int work[JOINTS]; /* periods until this axis has found its switch */
static unsigned int left[JOINTS];
static bool refuse, deaf;

static int setup(void **state)
{
	(void)state;
	rig_init(&rig);
	rig.exchange.legacy.on = true;
	rig.values.machine_is_on = true;
	home_plan_init(&plan, JOINTS);
	for (unsigned int i = 0; i < JOINTS; i++) {
		rig.exchange.legacy.linked[i] = true;
		rig.values.legacy.axis_set[i].enabled = 1;
		rig.values.legacy.axis_set[i].sequence = plan.sequence[i] = i == 2 ? 0 : 1;
		rig.values.legacy.axis_set[i].zero_position = 1000;
		rig.values.legacy.axis_set[i].home_position = 1100;
		rig.daemon.engine.axis[i].state = 1;
		rig.daemon.engine.axis[i].position = 77;
		work[i] = 20 + 10 * i;
		left[i] = 0;
	}
	refuse = deaf = false;
	seen = (struct home_result){ 0, 0 };
	rig_periods(&rig, 2);
	answered = rig.exchange.command.one_shot_head;
	return 0;
}

static void obey(const struct pokeys_one_shot *shot)
{
	for (unsigned int i = 0; i < JOINTS; i++) {
		struct pokeys_axis *axis = &rig.daemon.engine.axis[i];

		if (!(shot->mask >> i & 1))
			continue;
		if (shot->operation == POKEYS_ONE_SHOT_HOME)
			left[i] = work[i];
		else
			left[i] = 0;
		if (shot->operation == POKEYS_ONE_SHOT_HOME_FINISH ||
		    shot->operation == POKEYS_ONE_SHOT_HOME_CANCEL)
			axis->state = 1;
		if (shot->operation == POKEYS_ONE_SHOT_SET_POSITION)
			axis->position = shot->value[i];
	}
}

static void daemon_and_device(void)
{
	const struct pokeys_command *command = &rig.exchange.command;

	while (!deaf && answered != command->one_shot_head) {
		const struct pokeys_one_shot *shot =
			&command->one_shot[answered % POKEYS_ONE_SHOTS];

		rig.daemon.one_shot[answered % POKEYS_ONE_SHOT_RESULTS] =
			(struct pokeys_one_shot_result){
				.id = answered,
				.operation = shot->operation,
				.outcome = refuse ? POKEYS_OUTCOME_REFUSED : POKEYS_OUTCOME_DONE,
			};
		if (!refuse)
			obey(shot);
		rig.daemon.one_shot_ack = ++answered;
	}
	for (unsigned int i = 0; i < JOINTS; i++) {
		if (left[i])
			rig.daemon.engine.axis[i].state = --left[i] ? 12 : 10;
		if (command->axis[i].mode == POKEYS_AXIS_POSITION && !left[i])
			rig.daemon.engine.axis[i].position = command->axis[i].position;
	}
}

/* A servo period: read, homing, write; then the daemon. */
static void period(void)
{
	uint32_t state[HOME_JOINTS] = { 0 };
	struct home_result result;

	for (unsigned int i = 0; i < JOINTS; i++)
		state[i] = rig.values.legacy.axis[i].state;
	result = home_plan_step(&plan, state, PERIOD_S);
	seen.done |= result.done;
	seen.failed |= result.failed;
	for (unsigned int i = 0; i < JOINTS; i++)
		rig.values.legacy.axis[i].command = home_talk_command(&plan.talk[i]);
	rig.now_ns += RIG_MS;
	rig_daemon(&rig);
	rig_read(&rig);
	for (unsigned int i = 0; i < JOINTS; i++)
		rig.values.joint[i].pos_cmd = rig.values.joint[i].pos_fb; /* as motion does */
	rig_write(&rig);
	daemon_and_device();
}

static void periods(unsigned int count)
{
	while (count--)
		period();
}

static unsigned int until_done(unsigned int limit)
{
	unsigned int count = 0;

	while (home_plan_active(&plan) && count < limit) {
		period();
		count++;
	}
	return count;
}

static void all_home_in_order_and_stand_at_home(void **state)
{
	(void)state;
	home_plan_ask(&plan, home_plan_all(&plan));
	while (plan.group != 0x03) {
		assert_true(plan.group == 0 || plan.group == 0x04);
		period();
	}
	assert_int_equal(seen.done, 0x04);
	assert_in_range(until_done(1000), 1, 999);
	assert_int_equal(seen.done, 0x07);
	assert_int_equal(seen.failed, 0);
	for (unsigned int i = 0; i < JOINTS; i++)
		assert_int_equal(rig.daemon.engine.axis[i].position, 1100);
}

static void a_group_is_one_request(void **state)
{
	uint32_t before = rig.exchange.command.one_shot_head;

	(void)state;
	work[0] = 5;
	work[1] = 200;
	home_plan_ask(&plan, 0x03);
	periods(100);
	/* the one that has found its switch waits for the other */
	assert_int_equal(plan.talk[0].stage, HOME_STAGE_FOUND);
	assert_int_equal(rig.exchange.command.one_shot_head, before + 1);
	until_done(1000);
	assert_int_equal(seen.done, 0x03);
	/* home, finish, set position: each told once for both */
	assert_int_equal(rig.exchange.command.one_shot_head, before + 3);
}

static void without_a_final_move_it_stays(void **state)
{
	(void)state;
	plan.stay[2] = true;
	home_plan_ask(&plan, 0x04);
	until_done(1000);
	assert_int_equal(seen.done, 0x04);
	assert_int_equal(rig.daemon.engine.axis[2].position, 1000);
}

static void an_axis_that_still_says_home_is_not_believed(void **state)
{
	(void)state;
	rig.daemon.engine.axis[2].state = 10;
	deaf = true;
	home_plan_ask(&plan, 0x04);
	periods(100);
	assert_int_equal(plan.talk[2].stage, HOME_STAGE_ASKED);
	deaf = false;
	until_done(1000);
	assert_int_equal(seen.done, 0x04);
}

static void a_refusal_fails_and_lets_go(void **state)
{
	(void)state;
	refuse = true;
	home_plan_ask(&plan, home_plan_all(&plan));
	assert_in_range(until_done(2000), 1, 1999);
	assert_int_equal(seen.failed, 0x04);
	assert_int_equal(seen.done, 0);
	period();
	assert_int_equal(rig.values.legacy.axis[2].command, LEGACY_HOME_IDLE);
	assert_int_equal(plan.wanted, 0); /* the other sequence does not begin */
}

static void a_device_that_stops_fails_the_whole_group(void **state)
{
	(void)state;
	work[0] = work[1] = 500;
	home_plan_ask(&plan, 0x03);
	periods(100);
	left[1] = 0;
	rig.daemon.engine.axis[1].state = 0;
	until_done(2000);
	assert_int_equal(seen.failed, 0x02);
	assert_int_equal(seen.done, 0);
	assert_int_equal(rig.daemon.engine.axis[0].state, 1); /* was cancelled */
}

static void a_handshake_has_a_short_time_limit_a_search_a_long_one(void **state)
{
	(void)state;
	work[2] = 60000;
	home_plan_ask(&plan, 0x04);
	periods(50000);
	assert_int_equal(plan.talk[2].stage, HOME_STAGE_SEARCH);
	home_plan_cancel(&plan);
	until_done(2000);
	deaf = true;
	home_plan_ask(&plan, 0x04);
	periods(4900);
	assert_int_equal(seen.failed, 0);
	until_done(2000);
	assert_int_equal(seen.failed, 0x04);
}

static void every_stage_ends_by_itself(void **state)
{
	static const uint8_t lasts[HOME_STAGES] = {
		[HOME_STAGE_ASKED] = 1,  [HOME_STAGE_SEARCH] = 12,  [HOME_STAGE_FOUND] = 3,
		[HOME_STAGE_FINISH] = 3, [HOME_STAGE_ARM] = 4,      [HOME_STAGE_ARMED] = 18,
		[HOME_STAGE_MOVE] = 19,  [HOME_STAGE_GIVE_UP] = 12,
	};

	(void)state;
	for (uint8_t stage = HOME_STAGE_ASKED; stage < HOME_STAGES; stage++) {
		struct home_talk talk = { .stage = stage };

		for (unsigned int i = 0; i < 700; i++)
			home_talk_step(&talk, lasts[stage], false, 1);
		assert_int_equal(talk.stage, HOME_STAGE_IDLE);
	}
}

static void it_can_be_aborted_in_every_period(void **state)
{
	for (unsigned int after = 0;; after++) {
		setup(state);
		home_plan_ask(&plan, 0x03);
		for (unsigned int i = 0; i < after && home_plan_active(&plan); i++)
			period();
		if (!home_plan_active(&plan))
			break;
		home_plan_cancel(&plan);
		assert_in_range(until_done(1500), 0, 1499);
		periods(3);
		for (unsigned int i = 0; i < 2; i++) {
			assert_int_equal(rig.values.legacy.axis[i].command, LEGACY_HOME_IDLE);
			assert_int_equal(rig.daemon.engine.axis[i].state, 1);
		}
		assert_int_equal(seen.failed, 0);
		home_plan_ask(&plan, 0x03); /* and begun again */
		until_done(1000);
		assert_int_equal(seen.done & 0x03, 0x03);
	}
}

/* Motion cancels joints that say they are homing, and no others: one has to say it always. */
static void between_two_groups_it_can_be_aborted_as_well(void **state)
{
	(void)state;
	home_plan_ask(&plan, home_plan_all(&plan));
	period();
	while (home_plan_active(&plan)) {
		assert_int_not_equal(plan.group, 0);
		period();
	}
	assert_int_equal(seen.done, 0x07);
}

static void a_sequence_below_zero_takes_all_of_it(void **state)
{
	(void)state;
	plan.sequence[0] = -1;
	plan.sequence[1] = -1;
	plan.sequence[2] = HOME_SEQUENCE_NONE;
	assert_int_equal(home_plan_with(&plan, 0), 0x03);
	assert_int_equal(home_plan_with(&plan, 2), 0x04);
	assert_int_equal(home_plan_all(&plan), 0x03);
	plan.sequence[0] = plan.sequence[1] = 1;
	assert_int_equal(home_plan_with(&plan, 0), 0x01);
	assert_int_equal(home_plan_with(&plan, JOINTS), 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(all_home_in_order_and_stand_at_home, setup),
		cmocka_unit_test_setup(a_group_is_one_request, setup),
		cmocka_unit_test_setup(without_a_final_move_it_stays, setup),
		cmocka_unit_test_setup(an_axis_that_still_says_home_is_not_believed, setup),
		cmocka_unit_test_setup(a_refusal_fails_and_lets_go, setup),
		cmocka_unit_test_setup(a_device_that_stops_fails_the_whole_group, setup),
		cmocka_unit_test_setup(a_handshake_has_a_short_time_limit_a_search_a_long_one,
				       setup),
		cmocka_unit_test(every_stage_ends_by_itself),
		cmocka_unit_test_setup(it_can_be_aborted_in_every_period, setup),
		cmocka_unit_test_setup(between_two_groups_it_can_be_aborted_as_well, setup),
		cmocka_unit_test_setup(a_sequence_below_zero_takes_all_of_it, setup),
	};

	return cmocka_run_group_tests_name("halbridge/homing", tests, NULL, NULL);
}
